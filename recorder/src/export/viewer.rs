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
use super::messages::{
    CameraCalibration, Color, CylinderPrimitive, FrameTransform, FrameTransforms, LINE_LOOP, LinePrimitive,
    Log as LogLine, Point3, Pose, PosesInFrame, Quaternion, SceneEntity, SceneUpdate, SizedPrimitive,
    Vector3,
};
use super::{ExportError, States};
use crate::message::Kind;
use crate::reader::Log;
use crate::summary::outcome_text;
use crate::writer::LIBRARY;
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use prost::Message as _;
use prost_types::Timestamp;
use schemas::end::Outcome;
use schemas::log_time_ns;
use schemas::scene::Scene;
use schemas::scene::render::{Projection, Render};
use schemas::state::{BodyState, StateMessage};
use schemas::step::StepRecord;
use schemas::topics::FRAME_CHANNEL;
use serde::Serialize;
use std::collections::BTreeMap;
use std::io::{Seek, Write};

/// Bodies up to which each is drawn and has a frame of reference; of more, the poses of the rings alone are written:
/// viewers take seconds a frame for tens of thousands of frames of reference.
pub const BODIES_DRAWN_MAX: usize = 5_000;

/// Corners of the line that a ring is drawn as: 0.9 % of the radius off the circle at most.
const RING_CORNERS: u32 = 24;

/// The frame of reference of everything.
const WORLD: &str = "world";
/// That of the camera: x to the right, y down, z along the view.
const CAMERA: &str = "camera";

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

/// Writes the file, with the states that are asked for; the last one is always among them. The same log gives the same
/// bytes.
///
/// # Errors
///
/// [`ExportError`] if the log cannot be read or the sink refuses.
pub fn viewer<W: Write + Seek>(log: &Log, states: States, sink: W) -> Result<W, ExportError> {
    let scene = log.scene()?.scene;
    let mut file = File::create(log, sink)?;
    let drawn = scene.body_count() <= BODIES_DRAWN_MAX;
    let names: Vec<String> = (0..scene.body_count()).map(|body| frame_name(&scene, body)).collect();
    if drawn {
        file.write(Topic::Scene, 0, &scene_update(&scene, &names).encode_to_vec())?;
    }
    let last = (log.count(Kind::Step) as u64).saturating_sub(1);
    let mut end_ns = 0;
    for record in log.steps() {
        let record = record?;
        let time_ns = log_time_ns(record.sim_time_s);
        file.write(
            Topic::Metrics,
            time_ns,
            &serde_json::to_vec(&metrics(&record)).map_err(std::io::Error::other)?,
        )?;
        let frame = scene.time.frame_at(record.step);
        let wanted = states == States::All || frame.is_some() || record.step == last;
        if wanted && let Some(state) = log.state(record.step)? {
            let poses = rings(&scene, &state, time_ns);
            file.write(Topic::Poses, time_ns, &poses.encode_to_vec())?;
            if drawn {
                let transforms = transforms(&names, &state, time_ns);
                file.write(Topic::Transforms, time_ns, &transforms.encode_to_vec())?;
            }
        }
        if let Some(frame) = frame.and_then(|frame| usize::try_from(frame).ok())
            && frame < log.count(Kind::Frame).min(log.count(Kind::FrameInfo))
        {
            file.write_frame(log, frame, time_ns)?;
        }
        end_ns = time_ns;
    }
    let outcome = log.end()?.map(|end| end.outcome);
    let line = LogLine {
        timestamp: Some(timestamp(end_ns)),
        level: if outcome == Some(Outcome::Completed) { 2 } else { 3 },
        message: format!("the run: {}", outcome_text(outcome.as_ref())),
        name: "chainmail".to_owned(),
    };
    file.write(Topic::Log, end_ns, &line.encode_to_vec())?;
    file.finish()
}

/// The channels of the file.
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

struct File<W: Write + Seek> {
    mcap: mcap::Writer<W>,
    /// The channel of each topic; a log without frames has none of images.
    channels: Vec<Option<u16>>,
    sequences: Vec<u32>,
}

impl<W: Write + Seek> File<W> {
    fn create(log: &Log, sink: W) -> Result<File<W>, ExportError> {
        let options =
            WriteOptions::new().profile("").library(LIBRARY).compression(None).chunk_size(Some(4 << 20));
        let mut mcap = options.create(sink)?;
        let image = FRAME_CHANNEL.schema_data();
        let topics: [(&str, &str, Vec<u8>); 7] = [
            ("/scene", "SceneUpdate", descriptor("SceneUpdate")),
            ("/tf", "FrameTransforms", descriptor("FrameTransforms")),
            ("/rings/poses", "PosesInFrame", descriptor("PosesInFrame")),
            ("/camera/image", "CompressedImage", image),
            ("/camera/calibration", "CameraCalibration", descriptor("CameraCalibration")),
            ("/metrics", "", METRICS_SCHEMA.as_bytes().to_vec()),
            ("/log", "Log", descriptor("Log")),
        ];
        let mut channels = Vec::new();
        for (topic, message, schema) in topics {
            if topic.starts_with("/camera") && log.count(Kind::Frame) == 0 {
                channels.push(None);
                continue;
            }
            let (name, schema_encoding, encoding) = match message {
                "" => ("chainmail.Metrics".to_owned(), "jsonschema", "json"),
                message => (format!("foxglove.{message}"), "protobuf", "protobuf"),
            };
            let schema_id = mcap.add_schema(&name, schema_encoding, &schema)?;
            channels.push(Some(mcap.add_channel(schema_id, topic, encoding, &BTreeMap::new())?));
        }
        let sequences = vec![0; channels.len()];
        Ok(File { mcap, channels, sequences })
    }

    fn write(&mut self, topic: Topic, time_ns: u64, bytes: &[u8]) -> Result<(), ExportError> {
        let topic = topic as usize;
        let Some(channel_id) = self.channels[topic] else { return Ok(()) };
        let sequence = self.sequences[topic];
        self.sequences[topic] = sequence.wrapping_add(1);
        let header = MessageHeader { channel_id, sequence, log_time: time_ns, publish_time: time_ns };
        Ok(self.mcap.write_to_known_channel(&header, bytes)?)
    }

    /// A picture as the log has it, and the camera that took it.
    fn write_frame(&mut self, log: &Log, frame: usize, time_ns: u64) -> Result<(), ExportError> {
        self.write(Topic::Image, time_ns, &log.nth(Kind::Frame, frame)?.bytes)?;
        let render = log.frame_info(frame)?.render;
        if let Some(view) = View::of(&render) {
            let transforms = FrameTransforms { transforms: vec![view.transform(time_ns)] };
            self.write(Topic::Transforms, time_ns, &transforms.encode_to_vec())?;
            self.write(Topic::Calibration, time_ns, &view.calibration(&render, time_ns).encode_to_vec())?;
        }
        Ok(())
    }

    fn finish(mut self) -> Result<W, ExportError> {
        self.mcap.finish()?;
        let mut sink = self.mcap.into_inner();
        sink.flush()?;
        Ok(sink)
    }
}

fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 }
}

/// A body's frame of reference: `ring/3`.
fn frame_name(scene: &Scene, body: usize) -> String {
    scene.body_name(body).replace(' ', "/")
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

fn vector([x, y, z]: [f64; 3]) -> Vector3 {
    Vector3 { x, y, z }
}

fn quaternion([x, y, z, w]: [f64; 4]) -> Quaternion {
    Quaternion { x, y, z, w }
}

fn pose(body: &BodyState) -> Pose {
    Pose { position: Some(vector(body.position_m)), orientation: Some(quaternion(body.orientation)) }
}

fn rings(scene: &Scene, state: &StateMessage, time_ns: u64) -> PosesInFrame {
    let poses = state.bodies.iter().take(scene.rings.len()).map(pose).collect();
    PosesInFrame { timestamp: Some(timestamp(time_ns)), frame_id: WORLD.to_owned(), poses }
}

fn transforms(names: &[String], state: &StateMessage, time_ns: u64) -> FrameTransforms {
    let transform = |(name, body): (&String, &BodyState)| FrameTransform {
        timestamp: Some(timestamp(time_ns)),
        parent_frame_id: WORLD.to_owned(),
        child_frame_id: name.clone(),
        translation: Some(vector(body.position_m)),
        rotation: Some(quaternion(body.orientation)),
    };
    FrameTransforms { transforms: names.iter().zip(&state.bodies).map(transform).collect() }
}

/// Steel.
const GREY: Color = Color { r: 0.62, g: 0.64, b: 0.67, a: 1.0 };
/// What is no ring.
const BLUE: Color = Color { r: 0.35, g: 0.45, b: 0.7, a: 1.0 };
/// The ball that holds a polynomial body: its surface is not drawn.
const FAINT: Color = Color { r: 0.35, g: 0.45, b: 0.7, a: 0.25 };

/// Each body, drawn once in its own frame of reference.
fn scene_update(scene: &Scene, names: &[String]) -> SceneUpdate {
    let entity = |(body, name): (usize, &String)| SceneEntity {
        timestamp: Some(timestamp(0)),
        frame_id: name.clone(),
        id: name.clone(),
        frame_locked: true,
        ..shape(scene, body)
    };
    SceneUpdate { entities: names.iter().enumerate().map(entity).collect() }
}

/// The shape of a body, in the order of a state.
fn shape(scene: &Scene, body: usize) -> SceneEntity {
    let mut entity = SceneEntity::default();
    let sized = |size: [f64; 3], color: Color, z: f64| SizedPrimitive {
        pose: Some(at(z)),
        size: Some(vector(size)),
        color: Some(color),
    };
    let mut rest = body;
    if let Some(ring) = scene.rings.get(rest) {
        entity.lines.push(circle(ring.major_radius_m, 2.0 * ring.minor_radius_m));
        return entity;
    }
    rest -= scene.rings.len();
    if let Some(sphere) = scene.spheres.get(rest) {
        entity.spheres.push(sized([2.0 * sphere.radius_m; 3], BLUE, 0.0));
        return entity;
    }
    rest -= scene.spheres.len();
    if let Some(capsule) = scene.capsules.get(rest) {
        let (width, length) = (2.0 * capsule.radius_m, 2.0 * capsule.half_length_m);
        entity.cylinders.push(CylinderPrimitive {
            pose: Some(at(0.0)),
            size: Some(vector([width, width, length])),
            bottom_scale: 1.0,
            top_scale: 1.0,
            color: Some(BLUE),
        });
        for z in [-capsule.half_length_m, capsule.half_length_m] {
            entity.spheres.push(sized([width; 3], BLUE, z));
        }
        return entity;
    }
    rest -= scene.capsules.len();
    if let Some(cuboid) = scene.boxes.get(rest) {
        entity.cubes.push(sized(cuboid.half_extents_m.map(|half| 2.0 * half), BLUE, 0.0));
        return entity;
    }
    rest -= scene.boxes.len();
    if let Some(polynomial) = scene.polynomials.get(rest) {
        entity.spheres.push(sized([2.0 * polynomial.bounding_radius_m; 3], FAINT, 0.0));
    }
    entity
}

fn at(z: f64) -> Pose {
    Pose { position: Some(vector([0.0, 0.0, z])), orientation: Some(quaternion([0.0, 0.0, 0.0, 1.0])) }
}

/// A circle in the x-y plane.
fn circle(radius: f64, thickness: f64) -> LinePrimitive {
    let point = |corner: u32| {
        let angle = f64::from(corner) * (std::f64::consts::TAU / f64::from(RING_CORNERS));
        Point3 { x: radius * libm::cos(angle), y: radius * libm::sin(angle), z: 0.0 }
    };
    LinePrimitive {
        kind: LINE_LOOP,
        pose: Some(at(0.0)),
        thickness,
        points: (0..RING_CORNERS).map(point).collect(),
        color: Some(GREY),
    }
}

/// A camera that stands still and sees in perspective.
struct View {
    position: [f64; 3],
    /// To the right, down and along the view, World axes.
    axes: [[f64; 3]; 3],
    /// Focal length in pixels.
    focal_px: f64,
}

impl View {
    /// `None` for a camera that moves, or that no pinhole camera describes.
    fn of(render: &Render) -> Option<View> {
        let camera = &render.camera;
        if !camera.path.is_empty() || camera.projection != Projection::Perspective {
            return None;
        }
        let position = camera.position_m;
        let forward = unit([0, 1, 2].map(|axis| camera.look_at_m[axis] - position[axis]));
        let right = unit(cross(forward, camera.up));
        let down = cross(forward, right);
        let half = libm::tan(0.5 * camera.vertical_field_of_view_rad);
        let focal_px = 0.5 * f64::from(render.height_px) / half;
        Some(View { position, axes: [right, down, forward], focal_px })
    }

    fn transform(&self, time_ns: u64) -> FrameTransform {
        FrameTransform {
            timestamp: Some(timestamp(time_ns)),
            parent_frame_id: WORLD.to_owned(),
            child_frame_id: CAMERA.to_owned(),
            translation: Some(vector(self.position)),
            rotation: Some(quaternion(rotation_of(self.axes))),
        }
    }

    fn calibration(&self, render: &Render, time_ns: u64) -> CameraCalibration {
        let [left, top, width, height] = render.crop_px.unwrap_or([0, 0, render.width_px, render.height_px]);
        let (f, x, y) = (
            self.focal_px,
            0.5 * f64::from(render.width_px) - f64::from(left),
            0.5 * f64::from(render.height_px) - f64::from(top),
        );
        CameraCalibration {
            timestamp: Some(timestamp(time_ns)),
            frame_id: CAMERA.to_owned(),
            width,
            height,
            k: vec![f, 0.0, x, 0.0, f, y, 0.0, 0.0, 1.0],
            r: vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            p: vec![f, 0.0, x, 0.0, 0.0, f, y, 0.0, 0.0, 0.0, 1.0, 0.0],
        }
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(v: [f64; 3]) -> [f64; 3] {
    let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
    v.map(|part| part / length)
}

/// The unit quaternion `[x, y, z, w]` that turns the axes x, y and z into these.
///
/// # Source
///
/// S. W. Shepperd, "Quaternion from rotation matrix", J. Guidance and Control 1 (1978) 223: the largest of the four
/// squares is taken from the diagonal, the other three from it.
fn rotation_of([x, y, z]: [[f64; 3]; 3]) -> [f64; 4] {
    let trace = x[0] + y[1] + z[2];
    let squares = [1.0 + 2.0 * x[0] - trace, 1.0 + 2.0 * y[1] - trace, 1.0 + 2.0 * z[2] - trace, 1.0 + trace];
    let mut largest = 0;
    for part in 1..4 {
        if squares[part] > squares[largest] {
            largest = part;
        }
    }
    let (xy, xz, yz) = (x[1] + y[0], x[2] + z[0], y[2] + z[1]);
    let (wx, wy, wz) = (y[2] - z[1], z[0] - x[2], x[1] - y[0]);
    let of_largest = [
        [squares[0], xy, xz, wx],
        [xy, squares[1], yz, wy],
        [xz, yz, squares[2], wz],
        [wx, wy, wz, squares[3]],
    ];
    let scale = 0.5 / squares[largest].sqrt();
    of_largest[largest].map(|part| part * scale)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A quaternion applied to a vector, written out from q v q*.
    fn turned([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
        let axis = [x, y, z];
        let t = cross(axis, v).map(|part| 2.0 * part);
        let across = cross(axis, t);
        [0, 1, 2].map(|k| v[k] + w * t[k] + across[k])
    }

    #[test]
    fn the_cameras_axes_are_those_of_its_quaternion() {
        for look_at_m in
            [[0.0, 0.0, -1.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [-3.0, 2.0, 0.5], [0.1, -5.0, 0.2]]
        {
            let mut render = Render::default();
            (render.camera.position_m, render.camera.look_at_m) = ([0.0; 3], look_at_m);
            let view = View::of(&render).expect("a pinhole camera");
            let q = rotation_of(view.axes);
            for (axis, expected) in
                [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].into_iter().zip(view.axes)
            {
                let got = turned(q, axis);
                let error =
                    (0..3).map(|k| (got[k] - expected[k]).abs()).fold(0.0, |a, b| if b > a { b } else { a });
                // A dozen operations on numbers up to 2, each rounded by 1.1e-16 of them.
                assert!(error < 4e-15, "{look_at_m:?}: {error:e}");
            }
            assert!(view.axes[1][1] <= 0.0, "down is down: {:?}", view.axes);
        }
    }

    #[test]
    fn a_point_at_the_top_of_the_picture_is_on_its_edge() {
        let render = Render::default();
        let view = View::of(&render).expect("a pinhole camera");
        let calibration = view.calibration(&render, 0);
        // The upper edge of the field of view, 1 m in front of the camera.
        let up = libm::tan(0.5 * render.camera.vertical_field_of_view_rad);
        let y_px = calibration.k[4] * -up + calibration.k[5];
        assert!(y_px.abs() < 1e-10, "{y_px:e}");
    }
}
