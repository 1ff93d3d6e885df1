//! Differences of two states, field by field.

use super::Side;
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

/// How far positions are apart at a step.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Growth {
    /// The step.
    pub step: u64,
    /// Largest difference of a coordinate of any body's position, in metres.
    pub position_max_m: f64,
}

/// The first step before `limit` whose state has different bytes in the two logs.
pub(super) fn first_altered(sides: &[Side; 2], limit: u64) -> Option<u64> {
    let [a, b] = sides;
    let (mut i, mut j) = (0, 0);
    while i < a.count(Kind::State) && j < b.count(Kind::State) {
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
        (a != b).then(|| compare(step, &a, &b, scene))
    })
}

/// The states of a step, if both logs have them.
fn pair(sides: &[Side; 2], step: u64) -> Option<[StateMessage; 2]> {
    let state = |side: &Side| -> Option<StateMessage> {
        let index = side.log.state_index(step).ok()??;
        let message = side.message(Kind::State, index)?;
        side.check_state(step, &message.bytes);
        wire::decode(&message.bytes).ok()
    };
    Some([state(&sides[0])?, state(&sides[1])?])
}

/// How far positions are apart at a step and 1, 2, 4, 8, ... steps later, where both logs have states.
pub(super) fn growth(sides: &[Side; 2], first: u64) -> Vec<Growth> {
    let last = sides[0].count(Kind::Step).min(sides[1].count(Kind::Step)) as u64;
    let later = std::iter::once(0).chain((0..u64::BITS).map(|power| 1 << power));
    let steps = later.map_while(|later: u64| first.checked_add(later).filter(|&step| step < last));
    steps
        .filter_map(|step| {
            let [a, b] = pair(sides, step)?;
            let mut position_max_m = 0.0;
            for (a, b) in a.bodies.iter().zip(&b.bodies) {
                for axis in 0..3 {
                    let apart_m = (a.position_m[axis] - b.position_m[axis]).abs();
                    // A difference that is not a number shows, and stays.
                    if apart_m.is_nan() || apart_m > position_max_m {
                        position_max_m = apart_m;
                    }
                }
            }
            Some(Growth { step, position_max_m })
        })
        .collect()
}

fn compare(step: u64, a: &StateMessage, b: &StateMessage, scene: &Scene) -> StateDifference {
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
