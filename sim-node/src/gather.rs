//! The sums of all contact forces on each body.

use crate::chunk::Chunk;
use crate::team::share;
use crate::wrench::Wrench;
use geometry::Vec3;

/// Parts for each thread. Part of nothing: who shares the work does not show in a sum.
const PARTS_PER_THREAD: usize = 2;

/// Adds up the forces on all bodies, and their inelastic part where there is one, some bodies at a time, on any thread.
pub(crate) fn gather<const DAMPED: bool, const FRICTION: bool>(
    chunks: &[Chunk],
    wrenches: &mut [Wrench],
    lost: &mut [Wrench],
    pool: Option<&rayon::ThreadPool>,
) {
    let parts = pool.map_or(1, |pool| PARTS_PER_THREAD * pool.current_num_threads());
    let size = wrenches.len().div_ceil(parts).max(1);
    let bodies = wrenches.chunks_mut(size).zip(lost.chunks_mut(size)).enumerate();
    share(pool, bodies, |(part, (wrenches, lost))| {
        gather_part::<DAMPED, FRICTION>(chunks, (part * size) as u32, wrenches, lost);
    });
}

/// Adds up the forces on the bodies from `first` on: for each the kernel's in the order of its pairs, then the others in
/// the order of theirs.
fn gather_part<const DAMPED: bool, const FRICTION: bool>(
    chunks: &[Chunk],
    first: u32,
    wrenches: &mut [Wrench],
    lost: &mut [Wrench],
) {
    let loses = DAMPED || FRICTION;
    wrenches.fill(Wrench::ZERO);
    if loses {
        lost.fill(Wrench::ZERO);
    }
    let end = first + wrenches.len() as u32;
    let theirs = || chunks.iter().filter(|chunk| chunk.bodies[0] < end && first <= chunk.bodies[1]);
    // Numbers below the first become very large ones. A plane's are beyond all bodies': it takes what it gets and does
    // not move.
    let place = |body: u32| body.wrapping_sub(first) as usize;
    for arc in theirs().flat_map(|chunk| &chunk.rings.forces) {
        let [lost_force, lost_torque_a, lost_torque_b] = &arc.lost;
        let sides = [(arc.a, 1.0, &arc.torque_a, lost_torque_a), (arc.b, -1.0, &arc.torque_b, lost_torque_b)];
        for (body, sign, torque, lost_torque) in sides {
            let place = place(body);
            if let Some(wrench) = wrenches.get_mut(place) {
                add(wrench, sign, &arc.force, torque);
                if DAMPED {
                    add(&mut lost[place], sign, lost_force, lost_torque);
                }
            }
        }
    }
    for pair in theirs().flat_map(|chunk| &chunk.forces) {
        let sides = [(pair.a, &pair.on_a, &pair.lost_on_a), (pair.b, &pair.on_b, &pair.lost_on_b)];
        for (body, on, lost_on) in sides {
            let place = place(body);
            if let Some(wrench) = wrenches.get_mut(place) {
                wrench.add(on);
                if loses {
                    lost[place].add(lost_on);
                }
            }
        }
    }
}

/// Adds a force with a sign, and its torque.
#[inline]
fn add(wrench: &mut Wrench, sign: f64, force: &[f64; 4], torque: &[f64; 4]) {
    wrench.force += Vec3::new(sign * force[0], sign * force[1], sign * force[2]);
    wrench.torque += Vec3::new(torque[0], torque[1], torque[2]);
}
