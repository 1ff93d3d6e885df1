//! Bodies side by side: each number of sixteen bodies in one array, so that plain loops over the lanes
//! become vector instructions of whatever width the processor has.
//!
//! The one thing to know: a lane never looks at another lane, and the compiler may not reorder or fuse
//! arithmetic, so the bits of a body depend neither on its lane nor on the instructions chosen.

// Loops over lanes go over several arrays at once, and become vector instructions as they stand.
#![allow(clippy::needless_range_loop)]

use crate::body::{Body, Decay};
use crate::team::share;
use geometry::lanes::{Level, dispatch};
use geometry::{Vec3, rotation};
use schemas::state::BodyState;

/// Bodies in a block. A body's bits do not depend on it.
pub(crate) const LANES: usize = 16;

/// One number of each body of a block.
pub(crate) type Lane = [f64; LANES];
/// A vector of each body of a block.
pub(crate) type Lane3 = [Lane; 3];

/// A block without numbers in it.
pub(crate) const ZERO: Lane = [0.0; LANES];

/// Work on some blocks, alone or on any thread. It is compiled for each level of vector instructions, so all
/// that it calls in its loops must be `inline(always)`.
pub(crate) trait Chunk: Send {
    fn work(self);
}

/// Does the work of all chunks, on all threads where there are some.
pub(crate) fn on_threads<C: Chunk>(
    pool: Option<&rayon::ThreadPool>,
    level: Level,
    chunks: impl Iterator<Item = C>,
) {
    share(pool, chunks, |chunk| dispatch!(level, _ => chunk.work()));
}

#[inline(always)]
pub(crate) fn get(lanes: &Lane3, lane: usize) -> Vec3 {
    Vec3::new(lanes[0][lane], lanes[1][lane], lanes[2][lane])
}

#[inline(always)]
pub(crate) fn set(lanes: &mut Lane3, lane: usize, vector: Vec3) {
    lanes[0][lane] = vector.x;
    lanes[1][lane] = vector.y;
    lanes[2][lane] = vector.z;
}

/// The items of a block: a whole one as it is, the last one filled up with `empty`.
#[inline(always)]
pub(crate) fn whole<'a, T: Copy>(
    items: &'a [T],
    empty: T,
    filled: &'a mut Option<[T; LANES]>,
) -> &'a [T; LANES] {
    if let Ok(items) = items.try_into() {
        return items;
    }
    let filled = filled.insert([empty; LANES]);
    filled[..items.len()].copy_from_slice(items);
    filled
}

/// Constants of the bodies of a block.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Constants {
    /// Half the time step (s); 0 for a pinned body.
    pub half_time: Lane,
    pub major_radius: Lane,
    pub spin_share: Lane,
    pub inverse_mass: Lane,
    pub inverse_axial: Lane,
    pub inverse_transverse: Lane,
    pub linear_drag: Decays,
    pub axial_drag: Decays,
    pub transverse_drag: Decays,
}

/// One [`Decay`] of each body of a block.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Decays([Lane; 6]);

impl Decays {
    const ZERO: Decays = Decays([ZERO; 6]);

    #[inline(always)]
    pub(crate) fn get(&self, lane: usize) -> Decay {
        let [drag, keep, gain, reach, keep_squared, gain_squared] = &self.0;
        Decay {
            drag: drag[lane],
            keep: keep[lane],
            gain: gain[lane],
            reach: reach[lane],
            keep_squared: keep_squared[lane],
            gain_squared: gain_squared[lane],
        }
    }

    fn set(&mut self, lane: usize, decay: &Decay) {
        let Decay { drag, keep, gain, reach, keep_squared, gain_squared } = *decay;
        let values = [drag, keep, gain, reach, keep_squared, gain_squared];
        self.0.iter_mut().zip(values).for_each(|(numbers, value)| numbers[lane] = value);
    }
}

impl Constants {
    fn new(bodies: &[Body], half_time: f64) -> Constants {
        let mut constants = Constants {
            half_time: ZERO,
            major_radius: ZERO,
            spin_share: ZERO,
            inverse_mass: ZERO,
            inverse_axial: ZERO,
            inverse_transverse: ZERO,
            linear_drag: Decays::ZERO,
            axial_drag: Decays::ZERO,
            transverse_drag: Decays::ZERO,
        };
        for (lane, body) in bodies.iter().enumerate() {
            constants.half_time[lane] = if body.pinned { 0.0 } else { half_time };
            constants.major_radius[lane] = body.major_radius;
            constants.spin_share[lane] = body.spin_share;
            constants.inverse_mass[lane] = body.inverse_mass;
            constants.inverse_axial[lane] = body.inverse_axial;
            constants.inverse_transverse[lane] = body.inverse_transverse;
            constants.linear_drag.set(lane, &body.linear_drag);
            constants.axial_drag.set(lane, &body.axial_drag);
            constants.transverse_drag.set(lane, &body.transverse_drag);
        }
        constants
    }
}

/// The constants of all blocks. Blocks of equal bodies, which most are, share theirs, so that nothing of
/// them travels through memory.
#[derive(Clone, Debug, Default)]
pub(crate) struct Classes {
    classes: Vec<Constants>,
    class_of_block: Vec<u32>,
}

impl Classes {
    pub(crate) fn new(bodies: &[Body], half_time: f64) -> Classes {
        // Where hardly two blocks are equal there is no use in looking far back.
        const LOOK_BACK: usize = 8;
        let mut all = Classes::default();
        for block in bodies.chunks(LANES) {
            let constants = Constants::new(block, half_time);
            let recent = all.classes.len().saturating_sub(LOOK_BACK);
            let known = all.classes[recent..].iter().position(|class| *class == constants);
            let class = match known {
                Some(index) => recent + index,
                None => {
                    all.classes.push(constants);
                    all.classes.len() - 1
                }
            };
            all.class_of_block.push(class as u32);
        }
        all
    }

    #[inline(always)]
    pub(crate) fn of(&self, block: usize) -> &Constants {
        &self.classes[self.class_of_block[block] as usize]
    }
}

/// Poses and velocities of the bodies of a block.
pub(crate) struct Bodies {
    pub position: Lane3,
    /// x, y, z and w of the quaternion.
    pub orientation: [Lane; 4],
    pub linear: Lane3,
    pub angular: Lane3,
}

impl Bodies {
    #[inline(always)]
    pub(crate) fn load(states: &[BodyState; LANES]) -> Bodies {
        let mut bodies =
            Bodies { position: [ZERO; 3], orientation: [ZERO; 4], linear: [ZERO; 3], angular: [ZERO; 3] };
        for lane in 0..LANES {
            let state = &states[lane];
            set(&mut bodies.position, lane, state.position_m.into());
            for (numbers, value) in bodies.orientation.iter_mut().zip(state.orientation) {
                numbers[lane] = value;
            }
            set(&mut bodies.linear, lane, state.linear_velocity_m_per_s.into());
            set(&mut bodies.angular, lane, state.angular_velocity_rad_per_s.into());
        }
        bodies
    }
}

/// The axis of a body from its quaternion: as `rotation::axes` has it.
#[inline(always)]
pub(crate) fn normal(q: &[Lane; 4], lane: usize) -> Vec3 {
    let [i, j, k, w] = [q[0][lane], q[1][lane], q[2][lane], q[3][lane]];
    let (i2, j2, k2) = (i + i, j + j, k + k);
    Vec3::new(i * k2 + w * j2, j * k2 - w * i2, 1.0 - (i * i2 + j * j2))
}

/// Free rotation of symmetric tops: `q <- exp(time precession) q exp(time spin e3)`.
#[inline(always)]
pub(crate) fn turn(q: &mut [Lane; 4], precession: &Lane3, spin: &Lane, time: &Lane) {
    let (mut across, mut about) = ([ZERO; 3], ZERO);
    let (mut across_squared, mut about_squared) = (ZERO, ZERO);
    let (mut across_half, mut about_half) = ([ZERO; 2], [ZERO; 2]);
    let mut longest = ZERO;
    for lane in 0..LANES {
        let turned = get(precession, lane) * time[lane];
        set(&mut across, lane, turned);
        about[lane] = spin[lane] * time[lane];
        let (a, b) =
            (turned.x * turned.x + turned.y * turned.y + turned.z * turned.z, about[lane] * about[lane]);
        (across_squared[lane], about_squared[lane]) = (a, b);
        (across_half[0][lane], across_half[1][lane]) = rotation::half_angle_short(a);
        (about_half[0][lane], about_half[1][lane]) = rotation::half_angle_short(b);
        longest[lane] = if a > b { a } else { b };
    }
    // By each lane's own angle: the others of its block do not matter. A NaN is as good in either form.
    if longest.iter().any(|&squared| squared > rotation::SHORT_ANGLE_SQUARED) {
        for lane in 0..LANES {
            (across_half[0][lane], across_half[1][lane]) = rotation::half_angle(across_squared[lane]);
            (about_half[0][lane], about_half[1][lane]) = rotation::half_angle(about_squared[lane]);
        }
    }
    for lane in 0..LANES {
        let [qi, qj, qk, qw] = [q[0][lane], q[1][lane], q[2][lane], q[3][lane]];
        let v = get(&across, lane) * across_half[1][lane];
        let c = across_half[0][lane];
        let w = c * qw - (v.x * qi + v.y * qj + v.z * qk);
        let i = c * qi + v.x * qw + (v.y * qk - v.z * qj);
        let j = c * qj + v.y * qw + (v.z * qi - v.x * qk);
        let k = c * qk + v.z * qw + (v.x * qj - v.y * qi);
        let (c, s) = (about_half[0][lane], about[lane] * about_half[1][lane]);
        q[0][lane] = i * c + j * s;
        q[1][lane] = j * c - i * s;
        q[2][lane] = k * c + w * s;
        q[3][lane] = w * c - k * s;
    }
}
