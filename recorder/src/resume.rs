//! What a run that goes on takes over from its log: everything up to a step, as if it had just been sent.

use crate::fault::LogError;
use crate::message::{Kind, Message};
use crate::reader::Log;
use schemas::scene::Scene;
use schemas::state;

/// How many frames are taken over: those of keyframes up to a step that the log has. The others are rendered anew.
pub fn frames_kept(log: &Log, scene: &Scene, last_step: u64) -> u64 {
    let keyframes = (0..=last_step).filter(|&step| scene.time.frame_at(step).is_some()).count();
    [log.count(Kind::Frame), log.count(Kind::FrameInfo)].into_iter().fold(keyframes, usize::min) as u64
}

/// The messages of a log that are taken over, in its order: without the end, and without the state that a run which
/// ended early has at its last step alone.
///
/// # Errors
///
/// [`LogError`] if the log has no scene; each item if its message is damaged.
pub fn messages(
    log: &Log,
    last_step: u64,
) -> Result<impl Iterator<Item = Result<Message<'_>, LogError>>, LogError> {
    let scene = log.scene()?.scene;
    let frames = frames_kept(log, &scene, last_step);
    // How many of each kind have passed, as in `Kind::ALL`.
    let mut passed = [0_u64; 6];
    let selected = log.messages().map_while(move |message| {
        let Ok(message) = message else { return Some(Some(message)) };
        let [_, _, steps, _, infos, _] = passed;
        if steps > last_step && infos >= frames {
            return None;
        }
        let number = passed[message.kind.index()];
        passed[message.kind.index()] += 1;
        let is_wanted = match message.kind {
            Kind::Scene => number == 0,
            Kind::Step => number <= last_step,
            Kind::State => state::decode_header(&message.bytes)
                .is_ok_and(|header| header.step <= last_step && scene.state_is_recorded(header.step)),
            Kind::Frame | Kind::FrameInfo => number < frames,
            Kind::End => false,
        };
        Some(is_wanted.then_some(Ok(message)))
    });
    Ok(selected.flatten())
}
