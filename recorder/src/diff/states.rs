//! Differences of two states, field by field.

use super::Side;
use super::chunks::Chunks;
use crate::message::Kind;
use schemas::scene::Scene;
use schemas::state::{BodyState, ContactState, StateMessage};
use schemas::wire;
use serde::Serialize;

/// Differing fields that are listed; the others are counted.
const FIELDS_LISTED_MAX: usize = 12;

/// One number that differs.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FieldDifference {
    /// Whose it is: `ring 3`, `sphere 0`, `contact 2`, `header`.
    pub owner: String,
    /// Number of the body in the state, if it is a body's.
    pub body: Option<usize>,
    /// The field.
    pub field: &'static str,
    /// Which part of it: `x`, `y`, `z`, `w`; empty for a plain number.
    pub component: &'static str,
    /// The value in the first log.
    pub a: f64,
    /// The value in the second log.
    pub b: f64,
    /// The first value's bits, in hexadecimal.
    pub a_bits: String,
    /// The second value's bits.
    pub b_bits: String,
    /// How many doubles lie from one to the other; `None` if one is not a number, or they are not doubles.
    pub ulp: Option<u64>,
}

/// How two states differ.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct StateDifference {
    /// The step whose states were compared.
    pub step: u64,
    /// Which of them their logs do not keep: they were simulated again for this.
    pub made_again: [bool; 2],
    /// The first differing fields, in the order of the bytes.
    pub fields: Vec<FieldDifference>,
    /// How many fields differ.
    pub fields_differing: usize,
    /// How many bodies differ.
    pub bodies_differing: usize,
    /// Numbers of bodies of each.
    pub bodies: [usize; 2],
    /// Numbers of contact histories of each.
    pub contacts: [usize; 2],
}

/// How far two states are apart at a step.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// The step.
    pub step: u64,
    /// Its simulated time, in seconds.
    pub sim_time_s: f64,
    /// Largest difference of a coordinate of any body's position, in metres.
    pub position_max_m: f64,
    /// The body with that difference, as in `ring 3`; `None` if all positions are the same.
    pub body: Option<String>,
    /// Largest difference of a component of any body's linear velocity, in metres per second.
    pub velocity_max_m_per_s: f64,
    /// How many bodies differ in any bit.
    pub bodies_differing: usize,
}

/// The first step before `limit` whose state has different bytes in the two logs.
pub(super) fn first_altered(sides: &[Side; 2], chunks: &Chunks, limit: u64) -> Option<u64> {
    let [a, b] = sides;
    let (mut i, mut j) = (0, 0);
    while i < a.count(Kind::State) && j < b.count(Kind::State) {
        // What lies beyond the limit need not be looked at, and finding out costs a look at the step's number.
        let within = |side: &Side, index| side.log.state_step(index).is_ok_and(|step| step < limit);
        if (limit == u64::MAX || within(a, i)) && chunks.hold_the_same(Kind::State, [i, j]) {
            (i, j) = (i + 1, j + 1);
            continue;
        }
        let (Some(state_a), Some(state_b)) = (a.message(Kind::State, i), b.message(Kind::State, j)) else {
            return None;
        };
        let steps = [&state_a, &state_b]
            .map(|state| state.bytes.first_chunk().map(|bytes| u64::from_le_bytes(*bytes)));
        let [Some(step_a), Some(step_b)] = steps else { return None };
        // The step number itself may be what was altered: with every state logged, the places tell.
        let step = if step_a < step_b { step_a } else { step_b };
        if step >= limit {
            return None;
        }
        let same_place = i == j && a.count(Kind::State) == b.count(Kind::State);
        if (step_a == step_b || same_place) && state_a.bytes != state_b.bytes {
            a.check_state(step_a, &state_a.bytes);
            b.check_state(step_b, &state_b.bytes);
            return Some(step);
        }
        i += usize::from(step_a <= step_b);
        j += usize::from(step_b <= step_a);
    }
    None
}

/// Compares the states of the first step from `step` on that both logs have, and that differ.
pub(super) fn compare_from(sides: &[Side; 2], step: u64, scene: &Scene) -> Option<StateDifference> {
    let common = sides[0].count(Kind::Step).max(sides[1].count(Kind::Step)) as u64;
    (step..common).find_map(|step| {
        let [a, b] = pair(sides, step)?;
        let made_again = [0, 1].map(|side| matches!(sides[side].log.state_index(step), Ok(None)));
        (a != b).then(|| StateDifference { made_again, ..compare(step, &a, &b, scene) })
    })
}

/// The states of a step, if both logs have them, or they can be made again.
fn pair(sides: &[Side; 2], step: u64) -> Option<[StateMessage; 2]> {
    let state = |side: &Side| -> Option<StateMessage> {
        let Some(index) = side.log.state_index(step).ok()? else {
            // Why it cannot be had is no difference of the logs.
            return side.source.borrow_mut().state(step).ok()?;
        };
        let message = side.message(Kind::State, index)?;
        side.check_state(step, &message.bytes);
        wire::decode(&message.bytes).ok()
    };
    Some([state(&sides[0])?, state(&sides[1])?])
}

/// How far states are apart at a step and 1, 2, 4, 8, ... steps later, at the last step, and at `points` steps
/// between, evenly spaced; where both logs have states.
pub(super) fn growth(sides: &[Side; 2], first: u64, points: usize, scene: &Scene) -> Vec<Growth> {
    let count = sides[0].count(Kind::Step).min(sides[1].count(Kind::Step)) as u64;
    let Some(span) = count.checked_sub(1).and_then(|last| last.checked_sub(first)) else { return Vec::new() };
    let mut later: Vec<u64> = std::iter::once(0)
        .chain((0..u64::BITS).map(|power| 1 << power))
        .filter(|&later| later <= span)
        .collect();
    if points > 0 {
        // In this order no product overflows, and the last one is the last step.
        let points = points as u64;
        later.extend((1..=points).map(|point| span / points * point + span % points * point / points));
    }
    later.sort_unstable();
    later.dedup();
    later
        .into_iter()
        .filter_map(|later| {
            let [a, b] = pair(sides, first + later)?;
            Some(apart(first + later, &a, &b, scene))
        })
        .collect()
}

fn apart(step: u64, a: &StateMessage, b: &StateMessage, scene: &Scene) -> Growth {
    let sim_time_s = a.header.sim_time_s;
    let (mut position_max_m, mut velocity_max_m_per_s) = (0.0, 0.0);
    let (mut farthest, mut bodies_differing) = (None, 0);
    for (index, (a, b)) in a.bodies.iter().zip(&b.bodies).enumerate() {
        bodies_differing += usize::from(bytemuck::bytes_of(a) != bytemuck::bytes_of(b));
        if raise(&mut position_max_m, &a.position_m, &b.position_m) {
            farthest = Some(index);
        }
        raise(&mut velocity_max_m_per_s, &a.linear_velocity_m_per_s, &b.linear_velocity_m_per_s);
    }
    let body = farthest.map(|index| scene.body_name(index));
    Growth { step, sim_time_s, position_max_m, body, velocity_max_m_per_s, bodies_differing }
}

/// Raises `largest` to the largest difference of two vectors' components; says whether it did.
fn raise(largest: &mut f64, a: &[f64; 3], b: &[f64; 3]) -> bool {
    let before = *largest;
    for (a, b) in a.iter().zip(b) {
        let apart = (a - b).abs();
        // A difference that is not a number shows, and stays.
        if apart.is_nan() || apart > *largest {
            *largest = apart;
        }
    }
    largest.to_bits() != before.to_bits()
}

/// Compares two states of a step, field by field and bit by bit; `scene` names the bodies.
pub fn compare(step: u64, a: &StateMessage, b: &StateMessage, scene: &Scene) -> StateDifference {
    let mut list = List::default();
    list.numbers("header", None, "sim_time_s", &[""], &[a.header.sim_time_s], &[b.header.sim_time_s]);
    let (dissipated_a, dissipated_b) = (a.header.dissipated_energy_j, b.header.dissipated_energy_j);
    list.numbers("header", None, "dissipated_energy_j", &[""], &[dissipated_a], &[dissipated_b]);
    let mut bodies_differing = 0;
    for (index, (a, b)) in a.bodies.iter().zip(&b.bodies).enumerate() {
        let owner = scene.body_name(index);
        let before = list.count;
        list.body(&owner, index, a, b);
        bodies_differing += usize::from(list.count > before);
    }
    for (index, (a, b)) in a.contacts.iter().zip(&b.contacts).enumerate() {
        list.contact(&format!("contact {index}"), a, b);
    }
    StateDifference {
        step,
        made_again: [false; 2],
        fields: list.fields,
        fields_differing: list.count,
        bodies_differing,
        bodies: [a.bodies.len(), b.bodies.len()],
        contacts: [a.contacts.len(), b.contacts.len()],
    }
}

/// The differing fields found so far.
#[derive(Default)]
struct List {
    fields: Vec<FieldDifference>,
    count: usize,
}

const AXES: [&str; 4] = ["x", "y", "z", "w"];

impl List {
    fn body(&mut self, owner: &str, index: usize, a: &BodyState, b: &BodyState) {
        let body = Some(index);
        self.numbers(owner, body, "position_m", &AXES, &a.position_m, &b.position_m);
        self.numbers(owner, body, "orientation", &AXES, &a.orientation, &b.orientation);
        let (v_a, v_b) = (a.linear_velocity_m_per_s, b.linear_velocity_m_per_s);
        self.numbers(owner, body, "linear_velocity_m_per_s", &AXES, &v_a, &v_b);
        let (w_a, w_b) = (a.angular_velocity_rad_per_s, b.angular_velocity_rad_per_s);
        self.numbers(owner, body, "angular_velocity_rad_per_s", &AXES, &w_a, &w_b);
    }

    fn contact(&mut self, owner: &str, a: &ContactState, b: &ContactState) {
        self.index(owner, "body_a", a.body_a, b.body_a);
        self.index(owner, "body_b", a.body_b, b.body_b);
        self.index(owner, "arc", a.arc, b.arc);
        self.index(owner, "reserved", a.reserved, b.reserved);
        self.numbers(owner, None, "mid_cos", &[""], &[a.mid_cos], &[b.mid_cos]);
        self.numbers(owner, None, "mid_sin", &[""], &[a.mid_sin], &[b.mid_sin]);
        self.numbers(owner, None, "spring_m", &AXES, &a.spring_m, &b.spring_m);
    }

    fn numbers(
        &mut self,
        owner: &str,
        body: Option<usize>,
        field: &'static str,
        components: &[&'static str],
        a: &[f64],
        b: &[f64],
    ) {
        for (&component, (&a, &b)) in components.iter().zip(a.iter().zip(b)) {
            if a.to_bits() != b.to_bits() {
                let [a_bits, b_bits] = [a, b].map(|value| format!("{:#018x}", value.to_bits()));
                let (owner, ulp) = (owner.to_owned(), ulp_distance(a, b));
                self.push(FieldDifference { owner, body, field, component, a, b, a_bits, b_bits, ulp });
            }
        }
    }

    fn index(&mut self, owner: &str, field: &'static str, a: u32, b: u32) {
        if a != b {
            let [a_bits, b_bits] = [a, b].map(|value| format!("{value:#010x}"));
            let (owner, body, component, ulp) = (owner.to_owned(), None, "", None);
            let (a, b) = (f64::from(a), f64::from(b));
            self.push(FieldDifference { owner, body, field, component, a, b, a_bits, b_bits, ulp });
        }
    }

    fn push(&mut self, difference: FieldDifference) {
        self.count += 1;
        if self.fields.len() < FIELDS_LISTED_MAX {
            self.fields.push(difference);
        }
    }
}

/// How many doubles lie from one to the other: 0 for the same bits, 1 for neighbours. The two zeros are
/// neighbours of each other here. `None` if one is not a number.
pub fn ulp_distance(a: f64, b: f64) -> Option<u64> {
    if a.is_nan() || b.is_nan() {
        return None;
    }
    // Doubles in their order, as whole numbers: negative ones counted down from -0.
    let ordered = |value: f64| -> i128 {
        let magnitude = i128::from(value.to_bits() & !(1 << 63));
        if value.is_sign_negative() { -1 - magnitude } else { magnitude }
    };
    Some((ordered(a) - ordered(b)).unsigned_abs() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances() {
        assert_eq!(ulp_distance(1.0, 1.0), Some(0));
        assert_eq!(ulp_distance(1.0, 1.0 + f64::EPSILON), Some(1));
        assert_eq!(ulp_distance(0.0, -0.0), Some(1));
        assert_eq!(ulp_distance(f64::from_bits(1), -f64::from_bits(1)), Some(3));
        assert_eq!(ulp_distance(f64::INFINITY, f64::MAX), Some(1));
        assert_eq!(ulp_distance(f64::NAN, 1.0), None);
        assert_eq!(ulp_distance(f64::INFINITY, f64::NEG_INFINITY), Some(2 * 0x7FF0_0000_0000_0000 + 1));
    }
}
