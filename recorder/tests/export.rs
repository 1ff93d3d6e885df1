//! What an export holds is what the log holds.

mod sample;

use prost::Message as _;
use recorder::export::messages::{CameraCalibration, FrameTransforms, PosesInFrame, SceneUpdate};
use recorder::export::{States, csv, viewer};
use recorder::{Kept, Log};
use sample::Run;
use std::io::Cursor;

const RUN: Run = Run { rings: 3, steps_planned: 20, steps: 20, state_every: 1, renderer: true };

fn table(write: impl Fn(&mut dyn std::io::Write)) -> Vec<Vec<String>> {
    let mut bytes = Vec::new();
    write(&mut bytes);
    let text = String::from_utf8(bytes).expect("text");
    let lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect());
    lines.collect()
}

#[test]
fn tables_give_back_every_bit() {
    let log = RUN.log();
    let bodies = table(|sink| csv::bodies(&log, States::All, &mut Kept(&log), sink).expect("memory"));
    assert_eq!(bodies.len(), 1 + 21 * 3);
    let columns = bodies[0].len();
    for (index, line) in bodies[1..].iter().enumerate() {
        let (step, body) = (index as u64 / 3, index % 3);
        assert_eq!((line.len(), &line[0], &line[3]), (columns, &step.to_string(), &format!("ring {body}")));
        let expected = sample::bodies(step, 3)[body];
        let expected: Vec<u64> = [&expected.position_m[..], &expected.orientation]
            .concat()
            .into_iter()
            .chain(expected.linear_velocity_m_per_s)
            .chain(expected.angular_velocity_rad_per_s)
            .map(f64::to_bits)
            .collect();
        let got: Vec<u64> =
            line[4..].iter().map(|field| field.parse::<f64>().expect("a number").to_bits()).collect();
        assert_eq!(got, expected, "step {step}, ring {body}");
    }
    // A frame is taken at every other step.
    let frames = table(|sink| csv::bodies(&log, States::Frames, &mut Kept(&log), sink).expect("memory"));
    assert!(frames.len() == 1 + 10 * 3 || frames.len() == 1 + 11 * 3, "{}", frames.len());
    let steps = table(|sink| csv::steps(&log, sink).expect("memory"));
    assert_eq!(steps.len(), 22);
    assert!(steps.iter().all(|line| line.len() == steps[0].len()));
    let last = log.step(20).expect("a record");
    assert_eq!(steps[21][4].parse::<f64>().expect("a number").to_bits(), last.kinetic_energy_j.to_bits());
    assert_eq!(steps[21].last(), Some(&last.chained_hash.to_string()));
    assert_eq!(
        table(|sink| csv::contacts(&log, States::All, &mut Kept(&log), sink).expect("memory")).len(),
        1 + 21
    );
}

fn messages(log: &Log, states: States) -> Vec<(String, u64, Vec<u8>)> {
    let bytes = viewer(log, states, &mut Kept(log), Cursor::new(Vec::new())).expect("memory").into_inner();
    let messages = mcap::MessageStream::new(&bytes).expect("MCAP").map(|message| message.expect("a message"));
    messages
        .map(|message| (message.channel.topic.clone(), message.log_time, message.data.into_owned()))
        .collect()
}

#[test]
fn a_viewer_gets_bodies_camera_pictures_and_numbers() {
    let log = RUN.log();
    let all = messages(&log, States::All);
    assert!(all.is_sorted_by_key(|message| message.1), "times only rise");
    let of = |topic: &str| -> Vec<_> { all.iter().filter(|message| message.0 == topic).collect() };
    assert_eq!(
        (of("/scene").len(), of("/metrics").len(), of("/rings/poses").len(), of("/log").len()),
        (1, 21, 21, 1)
    );
    assert_eq!((of("/camera/image").len(), of("/camera/calibration").len()), (10, 10));
    // Poses and frames of reference are those of the state.
    for (step, message) in (0..).zip(of("/rings/poses")) {
        let poses = PosesInFrame::decode(&message.2[..]).expect("poses");
        let position = |index: usize| poses.poses[index].position.expect("a position");
        for (index, body) in sample::bodies(step, 3).iter().enumerate() {
            let p = position(index);
            assert_eq!([p.x, p.y, p.z], body.position_m, "step {step}");
        }
        assert_eq!((poses.frame_id.as_str(), message.1), ("world", 10_000_000 * step));
    }
    let scene = SceneUpdate::decode(&of("/scene")[0].2[..]).expect("a scene");
    let names: Vec<_> = scene.entities.iter().map(|entity| entity.frame_id.as_str()).collect();
    assert_eq!(names, ["ring/0", "ring/1", "ring/2"]);
    let line = &scene.entities[0].lines[0];
    assert_eq!(line.thickness, 0.2);
    for point in &line.points {
        let radius = (point.x * point.x + point.y * point.y).sqrt();
        assert!((radius - 0.5).abs() < 1e-15 && point.z == 0.0, "{radius}");
    }
    let transforms =
        of("/tf").into_iter().map(|message| FrameTransforms::decode(&message.2[..]).expect("transforms"));
    let children: std::collections::BTreeSet<String> = transforms
        .flat_map(|transforms| transforms.transforms)
        .map(|transform| transform.child_frame_id)
        .collect();
    assert_eq!(children.into_iter().collect::<Vec<_>>(), ["camera", "ring/0", "ring/1", "ring/2"]);
    let calibration = CameraCalibration::decode(&of("/camera/calibration")[0].2[..]).expect("a calibration");
    assert_eq!((calibration.width, calibration.height), (2, 2));
    // The pictures are the log's own bytes.
    assert_eq!(
        of("/camera/image")[3].2,
        log.nth(recorder::Kind::Frame, 3).expect("a frame").bytes.into_owned()
    );
    let metrics: serde_json::Value = serde_json::from_slice(&of("/metrics")[20].2).expect("JSON");
    // Kinetic 2 J, gravity -1 J; see the made-up run.
    assert_eq!((&metrics["kinetic_energy_j"], &metrics["step"]), (&2.0.into(), &20.into()));
    // Fewer states, the same numbers of every step; no channels of pictures where there are none.
    let few = messages(&Run { renderer: false, ..RUN }.log(), States::Frames);
    let count = |topic: &str| few.iter().filter(|message| message.0 == topic).count();
    assert!(count("/rings/poses") == 11 || count("/rings/poses") == 10, "{}", count("/rings/poses"));
    assert_eq!((count("/metrics"), count("/camera/image"), count("/camera/calibration")), (21, 0, 0));
}

#[test]
fn the_same_log_gives_the_same_file() {
    let log = RUN.log();
    let write = || {
        viewer(&log, States::Frames, &mut Kept(&log), Cursor::new(Vec::new())).expect("memory").into_inner()
    };
    assert!(write() == write());
}
