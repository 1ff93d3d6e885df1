//! Boxes with rounded edges, in their own frame: all points within `edge_radius` of the core
//! `|x| <= core.x, |y| <= core.y, |z| <= core.z`. The outer half extents are the core's plus the edge radius;
//! with an edge radius of 0 the box is sharp.

use crate::{Aabb, Vec3, capsule, shift::closest_approach};

/// Outward unit direction and signed distance of a point from the core's surface: negative inside (m).
///
/// The distance is a convex function of the point everywhere. Inside, the direction is that of the nearest
/// face, of equally near ones the first of x, y and z: it jumps where two faces are equally near.
#[inline]
pub fn core_distance(point: &Vec3, core: &Vec3) -> (Vec3, f64) {
    let beyond = Vec3::new(point.x.abs() - core.x, point.y.abs() - core.y, point.z.abs() - core.z);
    let signed = |axis: usize, length: f64| if point[axis] < 0.0 { -length } else { length };
    let out = Vec3::from_fn(|axis, _| if beyond[axis] > 0.0 { signed(axis, beyond[axis]) } else { 0.0 });
    let distance = out.norm_squared().sqrt();
    if distance > 0.0 {
        return (out * (1.0 / distance), distance);
    }
    let axis = nearest_face(&beyond);
    let mut normal = Vec3::zeros();
    normal[axis] = signed(axis, 1.0);
    (normal, beyond[axis])
}

/// The first axis with the largest value.
#[inline]
fn nearest_face(beyond: &Vec3) -> usize {
    let mut axis = 0;
    for other in 1..3 {
        if beyond[other] > beyond[axis] {
            axis = other;
        }
    }
    axis
}

/// Outward unit normal of the rounded box at a point on its surface.
#[inline]
pub fn normal(point: &Vec3, core: &Vec3, edge_radius: f64) -> Vec3 {
    if edge_radius > 0.0 {
        return core_distance(point, core).0;
    }
    // A sharp box: the face that the point lies on, whatever side of it rounding put the point on.
    let beyond = Vec3::new(point.x.abs() - core.x, point.y.abs() - core.y, point.z.abs() - core.z);
    let axis = nearest_face(&beyond);
    let mut normal = Vec3::zeros();
    normal[axis] = if point[axis] < 0.0 { -1.0 } else { 1.0 };
    normal
}

/// Ray parameter of the first crossing of the rounded box beyond `t_min`, or `None`; from inside it is the exit.
/// Own frame; `direction` is a unit vector.
///
/// The box is the union of three sharp boxes (the core, made longer by the edge radius along one axis each) and
/// twelve capsules (one about each edge of the core). It is convex, so a line is inside from the first of
/// their entries to the last of their exits.
pub fn ray_cuboid(origin: &Vec3, direction: &Vec3, core: &Vec3, edge_radius: f64, t_min: f64) -> Option<f64> {
    // Counted from the closest approach to the centre, so that an origin far away costs no accuracy.
    let (s, near) = closest_approach(origin, direction, core.norm() + edge_radius);
    let inverse = direction.map(|component| 1.0 / component);
    let slab = |half: &Vec3| {
        let (low, high) = (-half, *half);
        Aabb { min: low, max: high }.ray_interval(&near, &inverse, f64::NEG_INFINITY, f64::INFINITY)
    };
    let whole = slab(&core.add_scalar(edge_radius))?;
    let (entry, exit) =
        if edge_radius > 0.0 { rounded_interval(&near, direction, core, edge_radius, slab)? } else { whole };
    let (entry, exit) = (s + entry, s + exit);
    if entry > t_min { Some(entry) } else { (exit > t_min).then_some(exit) }
}

fn rounded_interval(
    origin: &Vec3,
    direction: &Vec3,
    core: &Vec3,
    edge_radius: f64,
    slab: impl Fn(&Vec3) -> Option<(f64, f64)>,
) -> Option<(f64, f64)> {
    let mut interval: Option<(f64, f64)> = None;
    let mut join = |part: Option<(f64, f64)>| {
        interval = match (interval, part) {
            (Some((a, b)), Some((c, d))) => Some((if c < a { c } else { a }, if d > b { d } else { b })),
            (all, one) => all.or(one),
        };
    };
    for axis in 0..3 {
        let mut half = *core;
        half[axis] += edge_radius;
        join(slab(&half));
        // The four edges along this axis, seen in a frame whose z axis it is.
        let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
        let turned = |v: &Vec3| Vec3::new(v[first], v[second], v[axis]);
        let (origin, direction) = (turned(origin), turned(direction));
        for (x, y) in [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)] {
            let edge = Vec3::new(x * core[first], y * core[second], 0.0);
            join(capsule::ray_interval(&(origin - edge), &direction, core[axis], edge_radius));
        }
    }
    interval
}

/// The corners of the core.
pub fn corners(core: &Vec3) -> [Vec3; 8] {
    core::array::from_fn(|index| {
        let side = |axis: usize| if index >> axis & 1 == 1 { core[axis] } else { -core[axis] };
        Vec3::new(side(0), side(1), side(2))
    })
}

/// The edges of the core, by their two ends.
pub fn edges(core: &Vec3) -> [(Vec3, Vec3); 12] {
    let corners = corners(core);
    core::array::from_fn(|index| {
        let (axis, which) = (index / 4, index % 4);
        let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
        let start = (which & 1) << first | (which >> 1) << second;
        (corners[start], corners[start | 1 << axis])
    })
}

/// The smallest box with faces parallel to World's axes around a rounded box with these unit axes.
pub fn bounding_box(centre: &Vec3, axes: &[Vec3; 3], core: &Vec3, edge_radius: f64) -> Aabb {
    let half = Vec3::from_fn(|world, _| {
        edge_radius + (0..3).map(|axis| axes[axis][world].abs() * core[axis]).sum::<f64>()
    });
    Aabb { min: centre - half, max: centre + half }
}

/// Principal moments of inertia of a solid box with rounded edges and uniform density, about its own axes
/// (kg m^2).
///
/// # Source
/// The box is cut into its core, six slabs on the faces, twelve quarter cylinders on the edges and eight
/// eighths of a ball on the corners; the second moment of each about the planes through the centre in closed
/// form.
pub fn inertia(core: &Vec3, edge_radius: f64, mass: f64) -> [f64; 3] {
    let (volume, second) = moments(core, edge_radius);
    let [x, y, z] = second.map(|moment| moment * mass / volume);
    [y + z, z + x, x + y]
}

/// Volume, and the integrals of x^2, y^2 and z^2 over the rounded box.
fn moments(core: &Vec3, e: f64) -> (f64, [f64; 3]) {
    const PI: f64 = core::f64::consts::PI;
    let box_volume = 8.0 * core.x * core.y * core.z;
    let mut volume = box_volume + 4.0 / 3.0 * PI * e * e * e;
    let mut second = [0.0; 3];
    for axis in 0..3 {
        let (c, b, d) = (core[axis], core[(axis + 1) % 3], core[(axis + 2) % 3]);
        // The two slabs across this axis, and the four quarter cylinders along it.
        let slabs = 8.0 * b * d * e;
        let cylinders = 2.0 * c * PI * e * e;
        volume += slabs + cylinders;
        // Of the square of this coordinate: the core; slabs from c to c + e; slabs of the other two axes;
        // cylinders along this axis; cylinders along the other two, and the ball, whose parts lie c out.
        let outer = c + e;
        let thick = (outer * outer * outer - c * c * c) / 3.0;
        let mut sum = box_volume * c * c / 3.0 + 8.0 * b * d * thick;
        sum += 8.0 * c * e * (b + d) * c * c / 3.0 + cylinders * c * c / 3.0;
        // A quarter disc's mean of y^2 is e^2 / 4, of y 4 e / (3 pi); an eighth of a ball's e^2 / 5 and 3 e / 8.
        let disc = c * c + 2.0 * c * 4.0 * e / (3.0 * PI) + 0.25 * e * e;
        sum += 2.0 * (b + d) * PI * e * e * disc;
        sum += 4.0 / 3.0 * PI * e * e * e * (c * c + 2.0 * c * 0.375 * e + 0.2 * e * e);
        second[axis] = sum;
    }
    (volume, second)
}
