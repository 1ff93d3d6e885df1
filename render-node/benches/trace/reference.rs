//! The scalar reference: a tree of two children a node in `f64`, one ray after the other.

use crate::axis;
use geometry::{Vec3, torus::ray_torus};
use render_node::{Ray, warp};
use schemas::scene::Scene;

/// Finds the first ring that a ray meets.
pub struct Reference {
    rings: Vec<(Vec3, [Vec3; 3])>,
    nodes: Vec<([Vec3; 2], usize, usize)>,
    order: Vec<usize>,
}

impl Reference {
    pub fn new(scene: &Scene) -> Reference {
        let rings = scene.rings.iter().map(|ring| {
            let z = axis(ring);
            let frame = warp::Frame::about(&z);
            (Vec3::from(ring.position_m), [frame.x, frame.y, z])
        });
        let rings: Vec<_> = rings.collect();
        let mut reference = Reference { order: (0..rings.len()).collect(), nodes: Vec::new(), rings };
        reference.build(0, reference.order.len());
        reference
    }

    /// Halves along the widest axis, down to two rings.
    fn build(&mut self, first: usize, count: usize) -> usize {
        let half = |axes: &[Vec3; 3]| axes[2].map(|n| (1.0 - n * n).abs().sqrt() + 0.18);
        let (mut low, mut high) = (Vec3::repeat(f64::INFINITY), Vec3::repeat(f64::NEG_INFINITY));
        for &ring in &self.order[first..first + count] {
            let (centre, axes) = &self.rings[ring];
            low = low.zip_map(&(centre - half(axes)), |a, b| if b < a { b } else { a });
            high = high.zip_map(&(centre + half(axes)), |a, b| if b > a { b } else { a });
        }
        let index = self.nodes.len();
        self.nodes.push(([low, high], first, count));
        if count > 2 {
            let axis = (high - low).imax();
            let rings = &self.rings;
            self.order[first..first + count].sort_by(|&a, &b| rings[a].0[axis].total_cmp(&rings[b].0[axis]));
            self.build(first, count / 2);
            let right = self.build(first + count / 2, count - count / 2);
            self.nodes[index].1 = right;
            self.nodes[index].2 = 0;
        }
        index
    }

    pub fn closest(&self, ray: &Ray, end: f64, any: bool) -> f64 {
        let inverse = ray.direction.map(|x| 1.0 / x);
        let mut best = end;
        let (mut stack, mut height) = ([0; 64], 1);
        while height > 0 {
            height -= 1;
            let index = stack[height];
            let ([low, high], first, count) = &self.nodes[index];
            let (mut start, mut stop) = (0.0, best);
            for axis in 0..3 {
                let a = (low[axis] - ray.origin[axis]) * inverse[axis];
                let b = (high[axis] - ray.origin[axis]) * inverse[axis];
                let (a, b) = if a < b { (a, b) } else { (b, a) };
                start = if a > start { a } else { start };
                stop = if b < stop { b } else { stop };
            }
            if start > stop {
                continue;
            }
            if *count == 0 {
                let axis = (high - low).imax();
                let (near, far) =
                    if ray.direction[axis] > 0.0 { (index + 1, *first) } else { (*first, index + 1) };
                (stack[height], stack[height + 1]) = (far, near);
                height += 2;
                continue;
            }
            for &ring in &self.order[*first..first + count] {
                if ray.leaves == Some(ring as u32) {
                    continue;
                }
                let (centre, [x, y, z]) = &self.rings[ring];
                let local = |v: &Vec3| Vec3::new(x.dot(v), y.dot(v), z.dot(v));
                let hit =
                    ray_torus(&local(&(ray.origin - centre)), &local(&ray.direction), 1.0, 0.18, 0.18e-6);
                if let Some(t) = hit.filter(|&t| t < best) {
                    best = t;
                    if any {
                        return best;
                    }
                }
            }
        }
        best
    }
}
