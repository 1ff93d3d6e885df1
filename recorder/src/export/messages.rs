//! The protobuf messages that viewers know by name: the part of Foxglove's schemas (`foxglove.*`, MIT licence) that an
//! export writes. Field numbers and types are those of the published `.proto` files; what is left out is optional there.

use prost::Message;
use prost_types::{Duration, Timestamp};

/// A vector or a size along three axes.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Vector3 {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// A rotation.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Quaternion {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
    /// w, the real part.
    #[prost(double, tag = "4")]
    pub w: f64,
}

/// Position and orientation.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Pose {
    /// Position, in metres.
    #[prost(message, optional, tag = "1")]
    pub position: Option<Vector3>,
    /// Orientation.
    #[prost(message, optional, tag = "2")]
    pub orientation: Option<Quaternion>,
}

/// Poses of many things in one frame of reference.
#[derive(Clone, PartialEq, Message)]
pub struct PosesInFrame {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The frame of reference.
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// The poses.
    #[prost(message, repeated, tag = "3")]
    pub poses: Vec<Pose>,
}

/// Where one frame of reference is in another.
#[derive(Clone, PartialEq, Message)]
pub struct FrameTransform {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The frame that the numbers are in.
    #[prost(string, tag = "2")]
    pub parent_frame_id: String,
    /// The frame that they are of.
    #[prost(string, tag = "3")]
    pub child_frame_id: String,
    /// Its origin.
    #[prost(message, optional, tag = "4")]
    pub translation: Option<Vector3>,
    /// Its orientation.
    #[prost(message, optional, tag = "5")]
    pub rotation: Option<Quaternion>,
}

/// Several of them.
#[derive(Clone, PartialEq, Message)]
pub struct FrameTransforms {
    /// The transforms.
    #[prost(message, repeated, tag = "1")]
    pub transforms: Vec<FrameTransform>,
}

/// A colour, each part from 0 to 1.
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Color {
    /// Red.
    #[prost(double, tag = "1")]
    pub r: f64,
    /// Green.
    #[prost(double, tag = "2")]
    pub g: f64,
    /// Blue.
    #[prost(double, tag = "3")]
    pub b: f64,
    /// Opacity.
    #[prost(double, tag = "4")]
    pub a: f64,
}

/// A point; the same layout as [`Vector3`].
#[derive(Clone, Copy, PartialEq, Message)]
pub struct Point3 {
    /// x.
    #[prost(double, tag = "1")]
    pub x: f64,
    /// y.
    #[prost(double, tag = "2")]
    pub y: f64,
    /// z.
    #[prost(double, tag = "3")]
    pub z: f64,
}

/// A line of some thickness.
#[derive(Clone, PartialEq, Message)]
pub struct LinePrimitive {
    /// [`LINE_LOOP`].
    #[prost(int32, tag = "1")]
    pub kind: i32,
    /// Where its points' origin is.
    #[prost(message, optional, tag = "2")]
    pub pose: Option<Pose>,
    /// Thickness, in metres.
    #[prost(double, tag = "3")]
    pub thickness: f64,
    /// Its points.
    #[prost(message, repeated, tag = "5")]
    pub points: Vec<Point3>,
    /// Its colour.
    #[prost(message, optional, tag = "6")]
    pub color: Option<Color>,
}

/// A line whose last point is joined to the first.
pub const LINE_LOOP: i32 = 1;

/// A sphere, a cube: what fills a box of this size; the two messages have one layout.
#[derive(Clone, PartialEq, Message)]
pub struct SizedPrimitive {
    /// Its centre and axes.
    #[prost(message, optional, tag = "1")]
    pub pose: Option<Pose>,
    /// Its extents along its own axes, in metres.
    #[prost(message, optional, tag = "2")]
    pub size: Option<Vector3>,
    /// Its colour.
    #[prost(message, optional, tag = "3")]
    pub color: Option<Color>,
}

/// A cylinder along z.
#[derive(Clone, PartialEq, Message)]
pub struct CylinderPrimitive {
    /// Its centre and axes.
    #[prost(message, optional, tag = "1")]
    pub pose: Option<Pose>,
    /// Its extents along its own axes, in metres.
    #[prost(message, optional, tag = "2")]
    pub size: Option<Vector3>,
    /// Width of the lower end, as a share of the size.
    #[prost(double, tag = "3")]
    pub bottom_scale: f64,
    /// Width of the upper end.
    #[prost(double, tag = "4")]
    pub top_scale: f64,
    /// Its colour.
    #[prost(message, optional, tag = "5")]
    pub color: Option<Color>,
}

/// A thing in the picture.
#[derive(Clone, PartialEq, Message)]
pub struct SceneEntity {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The frame of reference that it stands in.
    #[prost(string, tag = "2")]
    pub frame_id: String,
    /// Its name.
    #[prost(string, tag = "3")]
    pub id: String,
    /// How long it is shown; none is for ever.
    #[prost(message, optional, tag = "4")]
    pub lifetime: Option<Duration>,
    /// Whether it moves with its frame.
    #[prost(bool, tag = "5")]
    pub frame_locked: bool,
    /// Boxes.
    #[prost(message, repeated, tag = "8")]
    pub cubes: Vec<SizedPrimitive>,
    /// Spheres.
    #[prost(message, repeated, tag = "9")]
    pub spheres: Vec<SizedPrimitive>,
    /// Cylinders.
    #[prost(message, repeated, tag = "10")]
    pub cylinders: Vec<CylinderPrimitive>,
    /// Lines.
    #[prost(message, repeated, tag = "11")]
    pub lines: Vec<LinePrimitive>,
}

/// Things that come into the picture.
#[derive(Clone, PartialEq, Message)]
pub struct SceneUpdate {
    /// They.
    #[prost(message, repeated, tag = "2")]
    pub entities: Vec<SceneEntity>,
}

/// How a camera maps points to pixels.
#[derive(Clone, PartialEq, Message)]
pub struct CameraCalibration {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// The camera's frame: x to the right, y down, z along the view.
    #[prost(string, tag = "9")]
    pub frame_id: String,
    /// Width of the picture in pixels.
    #[prost(fixed32, tag = "2")]
    pub width: u32,
    /// Height of the picture in pixels.
    #[prost(fixed32, tag = "3")]
    pub height: u32,
    /// The camera's matrix, row by row: focal lengths and centre in pixels.
    #[prost(double, repeated, tag = "6")]
    pub k: Vec<f64>,
    /// Rectification: none.
    #[prost(double, repeated, tag = "7")]
    pub r: Vec<f64>,
    /// The projection, 3 by 4, row by row.
    #[prost(double, repeated, tag = "8")]
    pub p: Vec<f64>,
}

/// A line of a diary.
#[derive(Clone, PartialEq, Message)]
pub struct Log {
    /// Simulated time.
    #[prost(message, optional, tag = "1")]
    pub timestamp: Option<Timestamp>,
    /// 2 is information, 3 a warning.
    #[prost(int32, tag = "2")]
    pub level: i32,
    /// What it says.
    #[prost(string, tag = "3")]
    pub message: String,
    /// Who says it.
    #[prost(string, tag = "4")]
    pub name: String,
}
