//! Sweep and prune: bodies in order of their lower ends along one axis; two are near only if the later one
//! begins before the earlier one ends.

use super::pairs::{Bodies, Found, Workspace, widened};

/// The order of the last call: the next one is nearly the same, and quickly sorted.
#[derive(Debug, Default)]
pub(super) struct Sweep {
    order: Vec<(f64, u32)>,
    axis: usize,
}

pub(super) fn gather(bodies: &Bodies, workspace: &mut Workspace, found: &mut Found) {
    let Workspace { sweep: Sweep { order, axis }, packed, numbers, .. } = workspace;
    *axis = widest_axis(bodies, numbers);
    // Half the skin at each end; exact ends would be as long as the reach, and rounding is monotone.
    let half = |number: u32| widened(bodies.radii[number as usize] + 0.5 * bodies.skin);
    let lower = |number: u32| bodies.centres[number as usize][*axis] - half(number);
    if order.len() == numbers.len() && order.iter().all(|&(_, number)| is_among(numbers, number)) {
        order.iter_mut().for_each(|(low, number)| *low = lower(*number));
    } else {
        order.clear();
        order.extend(numbers.iter().map(|&number| (lower(number), number)));
    }
    // A stable sort takes ordered runs as they are; the order itself is total, and so owes nothing to the past.
    order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
    packed.fill(bodies, order.iter().map(|&(_, number)| number));
    for (place, &(_, number)) in order.iter().enumerate() {
        let high = bodies.centres[number as usize][*axis] + half(number);
        let rest = &order[place + 1..];
        let count = rest.iter().take_while(|&&(low, _)| low <= high).count();
        packed.meet(place, place + 1..place + 1 + count, bodies.skin, found);
    }
}

/// Whether a number is in a list of ordered numbers; nearly always at its own place.
fn is_among(numbers: &[u32], number: u32) -> bool {
    numbers.get(number as usize) == Some(&number) || numbers.binary_search(&number).is_ok()
}

fn widest_axis(bodies: &Bodies, numbers: &[u32]) -> usize {
    let mut widest = (f64::NEG_INFINITY, 0);
    for axis in 0..3 {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for &number in numbers {
            let value = bodies.centres[number as usize][axis];
            low = if value < low { value } else { low };
            high = if value > high { value } else { high };
        }
        if high - low > widest.0 {
            widest = (high - low, axis);
        }
    }
    widest.1
}
