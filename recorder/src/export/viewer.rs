//! A file for viewers (Foxglove, Lichtblick, Rerun): an MCAP of messages that they know by name, at simulated times.
//!
//! | Channel | Message | When |
//! |---|---|---|
//! | `/scene` | `foxglove.SceneUpdate`: each body in a frame of reference of its own | once |
//! | `/tf` | `foxglove.FrameTransforms`: those frames and the camera's in `world` | each state |
//! | `/rings/poses` | `foxglove.PosesInFrame`: rings in the scene's order, the axis is z | each state |
//! | `/camera/image` | `foxglove.CompressedImage`, the bytes of the log | each frame |
//! | `/camera/calibration` | `foxglove.CameraCalibration` of a camera that stands and sees in perspective | each frame |
//! | `/metrics` | JSON: energies, contacts, penetration | each step |
//! | `/log` | `foxglove.Log`: how the run ended | once, last |

use super::descriptor::descriptor;
use super::messages::{FrameTransforms, Log as LogLine};
use super::scenery::{View, frame_name, rings, scene_update, timestamp, transforms};
use super::{ExportError, States};
use crate::message::Kind;
use crate::reader::Log;
use crate::states::StateSource;
use crate::summary::outcome_text;
use crate::writer::LIBRARY;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use prost::Message as _;
use schemas::end::Outcome;
use schemas::log_time_ns;
use schemas::scene::Scene;
use schemas::state::StateMessage;
use schemas::step::StepRecord;
use schemas::topics::FRAME_CHANNEL;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Bodies up to which each is drawn and has a frame of reference; of more, the poses of the rings alone are written:
/// viewers take seconds a frame for tens of thousands of frames of reference.
pub const BODIES_DRAWN_MAX: usize = 5_000;

/// What a viewer plots; one for every step.
#[derive(Serialize)]
struct Metrics {
    step: u64,
    sim_time_s: f64,
    kinetic_energy_j: f64,
    gravity_energy_j: f64,
    contact_energy_j: f64,
    dissipated_energy_j: f64,
    /// All four.
    total_energy_j: f64,
    contacts: u64,
    candidate_pairs: u64,
    penetration_m: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    gap_min_m: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    links_intact: Option<u64>,
}

const METRICS_SCHEMA: &str = r#"{"title":"chainmail.Metrics","type":"object","properties":{"step":{"type":"integer"},"sim_time_s":{"type":"number"},"kinetic_energy_j":{"type":"number"},"gravity_energy_j":{"type":"number"},"contact_energy_j":{"type":"number"},"dissipated_energy_j":{"type":"number"},"total_energy_j":{"type":"number"},"contacts":{"type":"integer"},"candidate_pairs":{"type":"integer"},"penetration_m":{"type":"number"},"gap_min_m":{"type":"number"},"links_intact":{"type":"integer"}}}"#;

/// A channel for viewers, with its schema.
pub struct ViewChannel {
    /// Its topic.
    pub topic: &'static str,
    /// Encoding of its messages: `protobuf` or `json`.
    pub encoding: &'static str,
    /// Name of its schema.
    pub schema_name: String,
    /// Encoding of its schema: `protobuf` or `jsonschema`.
    pub schema_encoding: &'static str,
    /// The schema.
    pub schema: Vec<u8>,
}

/// The channels, by their place in [`Viewer::channels`].
#[derive(Clone, Copy)]
enum Topic {
    Scene,
    Transforms,
    Poses,
    Image,
    Calibration,
    Metrics,
    Log,
}

/// Takes a message: the number of its channel, its time in nanoseconds, its bytes.
pub type Put<'a> = dyn FnMut(usize, u64, &[u8]) -> Result<(), ExportError> + 'a;

/// A log as viewers see it, message by message; for a file, and for those who watch live.
pub struct Viewer<'a> {
    log: &'a Log,
    scene: Scene,
    /// The bodies' frames of reference; none if there are too many bodies.
    names: Vec<String>,
}

impl<'a> Viewer<'a> {
    /// A viewer's sight of a log.
    ///
    /// # Errors
    ///
    /// [`ExportError::Log`] if the scene cannot be read.
    pub fn new(log: &'a Log) -> Result<Viewer<'a>, ExportError> {
        let scene = log.scene()?.scene;
        let count = scene.body_count();
        let drawn = if count <= BODIES_DRAWN_MAX { count } else { 0 };
        let names = (0..drawn).map(|body| frame_name(&scene, body)).collect();
        Ok(Viewer { log, scene, names })
    }

    /// The scene.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// All channels. Those of pictures stay empty if the log has none.
    pub fn channels() -> Vec<ViewChannel> {
        let foxglove = |topic: &'static str, message: &str, schema: Vec<u8>| ViewChannel {
            topic,
            encoding: "protobuf",
            schema_name: format!("foxglove.{message}"),
            schema_encoding: "protobuf",
            schema,
        };
        let metrics = ViewChannel {
            topic: "/metrics",
            encoding: "json",
            schema_name: "chainmail.Metrics".to_owned(),
            schema_encoding: "jsonschema",
            schema: METRICS_SCHEMA.as_bytes().to_vec(),
        };
        vec![
            foxglove("/scene", "SceneUpdate", descriptor("SceneUpdate")),
            foxglove("/tf", "FrameTransforms", descriptor("FrameTransforms")),
            foxglove("/rings/poses", "PosesInFrame", descriptor("PosesInFrame")),
            foxglove("/camera/image", "CompressedImage", FRAME_CHANNEL.schema_data()),
            foxglove("/camera/calibration", "CameraCalibration", descriptor("CameraCalibration")),
            metrics,
            foxglove("/log", "Log", descriptor("Log")),
        ]
    }

    /// The bodies' shapes.
    ///
    /// # Errors
    ///
    /// Those of `put`, as for all that follow.
    pub fn put_scene(&self, time_ns: u64, put: &mut Put) -> Result<(), ExportError> {
        if self.names.is_empty() {
            return Ok(());
        }
        let update = scene_update(&self.scene, &self.names, time_ns);
        put(Topic::Scene as usize, time_ns, &update.encode_to_vec())
    }

    /// The numbers of a step.
    ///
    /// # Errors
    ///
    /// [`ExportError::Log`] if its record cannot be read.
    pub fn put_metrics(&self, step: u64, put: &mut Put) -> Result<u64, ExportError> {
        let record = self.log.step(step)?;
        let time_ns = log_time_ns(record.sim_time_s);
        let bytes = serde_json::to_vec(&metrics(&record)).map_err(std::io::Error::other)?;
        put(Topic::Metrics as usize, time_ns, &bytes)?;
        Ok(time_ns)
    }

    /// Poses and frames of reference of a state, as of a time.
    ///
    /// # Errors
    ///
    /// Those of `put`.
    pub fn put_state(&self, state: &StateMessage, time_ns: u64, put: &mut Put) -> Result<(), ExportError> {
        put(Topic::Poses as usize, time_ns, &rings(&self.scene, state, time_ns).encode_to_vec())?;
        if self.names.is_empty() {
            return Ok(());
        }
        put(Topic::Transforms as usize, time_ns, &transforms(&self.names, state, time_ns).encode_to_vec())
    }

    /// A picture as the log has it, and the camera that took it, as of a time; nothing if there is no such frame.
    ///
    /// # Errors
    ///
    /// [`ExportError::Log`] if it cannot be read.
    pub fn put_frame(&self, frame: u64, time_ns: u64, put: &mut Put) -> Result<(), ExportError> {
        let count = self.log.count(Kind::Frame).min(self.log.count(Kind::FrameInfo));
        let Some(frame) = usize::try_from(frame).ok().filter(|&frame| frame < count) else { return Ok(()) };
        put(Topic::Image as usize, time_ns, &self.log.nth(Kind::Frame, frame)?.bytes)?;
        let render = self.log.frame_info(frame)?.render;
        let Some(view) = View::of(&render) else { return Ok(()) };
        let transforms = FrameTransforms { transforms: vec![view.transform(time_ns)] };
        put(Topic::Transforms as usize, time_ns, &transforms.encode_to_vec())?;
        put(Topic::Calibration as usize, time_ns, &view.calibration(&render, time_ns).encode_to_vec())
    }

    /// How the run ended.
    ///
    /// # Errors
    ///
    /// [`ExportError::Log`] if that cannot be read.
    pub fn put_end(&self, time_ns: u64, put: &mut Put) -> Result<(), ExportError> {
        let outcome = self.log.end()?.map(|end| end.outcome);
        let line = LogLine {
            timestamp: Some(timestamp(time_ns)),
            level: if outcome == Some(Outcome::Completed) { 2 } else { 3 },
            message: format!("the run: {}", outcome_text(outcome.as_ref())),
            name: "chainmail".to_owned(),
        };
        put(Topic::Log as usize, time_ns, &line.encode_to_vec())
    }
}

/// Writes the file, with the states that are asked for; the last one is always among them. The same log gives the same
/// bytes.
///
/// # Errors
///
/// [`ExportError`] if the log cannot be read or the sink refuses.
pub fn viewer<W: Write + Seek>(
    log: &Log,
    states: States,
    source: &mut dyn StateSource,
    sink: W,
) -> Result<W, ExportError> {
    let viewer = Viewer::new(log)?;
    let mut file = File::create(log, sink)?;
    let mut put = |channel: usize, time_ns: u64, bytes: &[u8]| file.write(channel, time_ns, bytes);
    viewer.put_scene(0, &mut put)?;
    let count = log.count(Kind::Step) as u64;
    let mut time_ns = 0;
    for step in 0..count {
        time_ns = viewer.put_metrics(step, &mut put)?;
        let frame = viewer.scene.time.frame_at(step);
        if (states == States::All || frame.is_some() || step + 1 == count)
            && let Some(state) = source.state(step)?
        {
            viewer.put_state(&state, time_ns, &mut put)?;
        }
        if let Some(frame) = frame {
            viewer.put_frame(frame, time_ns, &mut put)?;
        }
    }
    viewer.put_end(time_ns, &mut put)?;
    file.finish()
}

struct File<W: Write + Seek> {
    mcap: mcap::Writer<W>,
    /// Number of each channel in the file, and of its next message; a log without frames has no channels of pictures.
    channels: Vec<Option<(u16, u32)>>,
}

impl<W: Write + Seek> File<W> {
    fn create(log: &Log, sink: W) -> Result<File<W>, ExportError> {
        let options =
            WriteOptions::new().profile("").library(LIBRARY).compression(None).chunk_size(Some(4 << 20));
        let mut mcap = options.create(sink)?;
        let mut channels = Vec::new();
        for channel in Viewer::channels() {
            if channel.topic.starts_with("/camera") && log.count(Kind::Frame) == 0 {
                channels.push(None);
                continue;
            }
            let schema_id =
                mcap.add_schema(&channel.schema_name, channel.schema_encoding, &channel.schema)?;
            let id = mcap.add_channel(schema_id, channel.topic, channel.encoding, &BTreeMap::new())?;
            channels.push(Some((id, 0)));
        }
        Ok(File { mcap, channels })
    }

    fn write(&mut self, channel: usize, time_ns: u64, bytes: &[u8]) -> Result<(), ExportError> {
        let Some((channel_id, next)) = &mut self.channels[channel] else { return Ok(()) };
        let (channel_id, sequence) = (*channel_id, *next);
        *next = sequence.wrapping_add(1);
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        Ok(self.mcap.write_to_known_channel(&header, bytes)?)
    }

    fn finish(mut self) -> Result<W, ExportError> {
        self.mcap.finish()?;
        let mut sink = self.mcap.into_inner();
        sink.flush()?;
        Ok(sink)
    }
}

fn metrics(record: &StepRecord) -> Metrics {
    let audit = record.audit;
    Metrics {
        step: record.step,
        sim_time_s: record.sim_time_s,
        kinetic_energy_j: record.kinetic_energy_j,
        gravity_energy_j: record.gravity_energy_j,
        contact_energy_j: record.contact_energy_j,
        dissipated_energy_j: record.dissipated_energy_j,
        total_energy_j: record.kinetic_energy_j
            + record.gravity_energy_j
            + record.contact_energy_j
            + record.dissipated_energy_j,
        contacts: record.contacts,
        candidate_pairs: record.candidate_pairs,
        penetration_m: record.penetration_m,
        gap_min_m: audit.and_then(|audit| audit.gap_min_m),
        links_intact: audit.map(|audit| audit.links_intact),
    }
}
