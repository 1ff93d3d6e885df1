//! What a viewer is shown of a scene: bodies, frames of reference, the camera.

use super::messages::{
    CameraCalibration, Color, CylinderPrimitive, FrameTransform, FrameTransforms, LINE_LOOP, LinePrimitive,
    Point3, Pose, PosesInFrame, Quaternion, SceneEntity, SceneUpdate, SizedPrimitive, Vector3,
};
use prost_types::Timestamp;
use schemas::scene::Scene;
use schemas::scene::render::{Projection, Render};
use schemas::state::{BodyState, StateMessage};

/// Corners of the line that a ring is drawn as: 0.9 % of the radius off the circle at most.
const RING_CORNERS: u32 = 24;

/// The frame of reference of everything.
const WORLD: &str = "world";
/// That of the camera: x to the right, y down, z along the view.
const CAMERA: &str = "camera";

pub(super) fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 }
}

/// A body's frame of reference: `ring/3`.
pub(super) fn frame_name(scene: &Scene, body: usize) -> String {
    scene.body_name(body).replace(' ', "/")
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

pub(super) fn rings(scene: &Scene, state: &StateMessage, time_ns: u64) -> PosesInFrame {
    let poses = state.bodies.iter().take(scene.rings.len()).map(pose).collect();
    PosesInFrame { timestamp: Some(timestamp(time_ns)), frame_id: WORLD.to_owned(), poses }
}

pub(super) fn transforms(names: &[String], state: &StateMessage, time_ns: u64) -> FrameTransforms {
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
pub(super) fn scene_update(scene: &Scene, names: &[String], time_ns: u64) -> SceneUpdate {
    let entity = |(body, name): (usize, &String)| SceneEntity {
        timestamp: Some(timestamp(time_ns)),
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
pub(super) struct View {
    position: [f64; 3],
    /// To the right, down and along the view, World axes.
    axes: [[f64; 3]; 3],
    /// Focal length in pixels.
    focal_px: f64,
}

impl View {
    /// `None` for a camera that moves, or that no pinhole camera describes.
    pub fn of(render: &Render) -> Option<View> {
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

    pub fn transform(&self, time_ns: u64) -> FrameTransform {
        FrameTransform {
            timestamp: Some(timestamp(time_ns)),
            parent_frame_id: WORLD.to_owned(),
            child_frame_id: CAMERA.to_owned(),
            translation: Some(vector(self.position)),
            rotation: Some(quaternion(rotation_of(self.axes))),
        }
    }

    pub fn calibration(&self, render: &Render, time_ns: u64) -> CameraCalibration {
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
