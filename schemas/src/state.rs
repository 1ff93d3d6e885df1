//! The state of a run after a step, as it travels over the bus and lies in the log: the same bytes.

use crate::{Hash, wire};
use bytemuck::{Pod, Zeroable};
use serde::{Deserialize, Serialize};

// The layouts below are memory images as well as file formats.
const _: () = assert!(size_of::<StateHeader>() == 56);
const _: () = assert!(size_of::<BodyState>() == 104);
const _: () = assert!(size_of::<ContactState>() == 56);

/// What stands before the bodies in a state message. 56 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C)]
pub struct StateHeader {
    /// Steps done; the initial state is step 0.
    pub step: u64,
    /// Simulated time, `step * time_step_s`, in seconds.
    pub sim_time_s: f64,
    /// Mechanical energy taken out by damping, friction and drag since step 0, in joules; part of the state
    /// because the energy audit of the next step needs it.
    pub dissipated_energy_j: f64,
    /// BLAKE3 of the message without this field.
    pub state_hash: Hash,
}

/// One moving body: rings first, then spheres, capsules, boxes and polynomials, each in scene order. 104 bytes. World frame, SI
/// units.
#[derive(Clone, Copy, Debug, PartialEq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C)]
pub struct BodyState {
    /// Centre of mass, in metres.
    pub position_m: [f64; 3],
    /// Unit quaternion `[x, y, z, w]` from body axes to World axes.
    pub orientation: [f64; 4],
    /// Velocity of the centre of mass, in metres per second.
    pub linear_velocity_m_per_s: [f64; 3],
    /// Angular velocity, in World axes, in radians per second.
    pub angular_velocity_rad_per_s: [f64; 3],
}

/// The history of one contact that slides or sticks: what friction remembers. 56 bytes.
///
/// Only contacts with friction have one. Entries are ordered by (`body_a`, `body_b`, `arc`).
#[derive(Clone, Copy, Debug, PartialEq, Default, Pod, Zeroable, Serialize, Deserialize)]
#[repr(C)]
pub struct ContactState {
    /// The body whose centreline carries the contact arc. Bodies are numbered as in the state; planes follow.
    pub body_a: u32,
    /// The other body.
    pub body_b: u32,
    /// Which of the pair's contacts this is: 0 or 1.
    pub arc: u32,
    /// Always zero: keeps the doubles aligned without hidden bytes.
    pub reserved: u32,
    /// Cosine of the angle of the contact's middle on A's centreline, measured from A's own x axis; by this a
    /// contact is recognised in the next step.
    pub mid_cos: f64,
    /// Sine of that angle.
    pub mid_sin: f64,
    /// Displacement of the tangential spring, B relative to A, World axes, in metres.
    pub spring_m: [f64; 3],
}

/// A whole state: header, bodies, contact history.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct StateMessage {
    /// Step, time and hash.
    pub header: StateHeader,
    /// Rings, spheres, capsules, boxes, polynomials.
    pub bodies: Vec<BodyState>,
    /// Contact history; empty without friction.
    pub contacts: Vec<ContactState>,
}

/// Bytes of the header before the hash; the hash is the header's last field.
const HASHED_HEADER_BYTES: usize = size_of::<StateHeader>() - size_of::<Hash>();

/// Writes a state message into `message`, which is cleared first, and returns the state hash it put in.
///
/// The bytes are: header, `u64` body count, bodies, `u64` contact count, contacts; little-endian, without
/// padding; identical to [`wire::encode`] of a [`StateMessage`]. The header's `state_hash` is ignored and
/// computed here.
pub fn encode(
    header: &StateHeader,
    bodies: &[BodyState],
    contacts: &[ContactState],
    message: &mut Vec<u8>,
) -> Hash {
    message.clear();
    if cfg!(target_endian = "big") {
        let copy = StateMessage { header: *header, bodies: bodies.to_vec(), contacts: contacts.to_vec() };
        message.extend_from_slice(&wire::encode(&copy));
    } else {
        message.extend_from_slice(bytemuck::bytes_of(header));
        message.extend_from_slice(&(bodies.len() as u64).to_le_bytes());
        message.extend_from_slice(bytemuck::cast_slice(bodies));
        message.extend_from_slice(&(contacts.len() as u64).to_le_bytes());
        message.extend_from_slice(bytemuck::cast_slice(contacts));
    }
    let hash = hash_of(message);
    message[HASHED_HEADER_BYTES..size_of::<StateHeader>()].copy_from_slice(&hash.0);
    hash
}

/// The hash that a state message ought to carry: BLAKE3 of all its bytes but the hash field.
///
/// # Panics
///
/// If the message is shorter than a header.
pub fn hash_of(message: &[u8]) -> Hash {
    Hash::of_parts(&[&message[..HASHED_HEADER_BYTES], &message[size_of::<StateHeader>()..]])
}

/// A state message that cannot be believed.
#[derive(Debug, thiserror::Error)]
pub enum StateError {
    /// Not the layout of a state.
    #[error(transparent)]
    Wire(#[from] wire::WireError),
    /// The bytes are whole, but not those that were hashed.
    #[error("the state of step {step} carries the hash {saved}, but its bytes hash to {calculated}")]
    Hash {
        /// The step that the header names.
        step: u64,
        /// The hash in the message.
        saved: Hash,
        /// The hash of the message.
        calculated: Hash,
    },
}

/// Reads only the header of a state message.
///
/// # Errors
///
/// [`StateError::Wire`] if there are fewer bytes than a header has.
pub fn decode_header(message: &[u8]) -> Result<StateHeader, StateError> {
    let end = message.len().min(size_of::<StateHeader>());
    Ok(wire::decode(&message[..end])?)
}

/// Reads a state message and checks its hash.
///
/// # Errors
///
/// [`StateError`] if the layout or the hash is wrong. Lengths are checked against the bytes at hand before
/// they are believed.
pub fn decode(message: &[u8]) -> Result<StateMessage, StateError> {
    let state: StateMessage = wire::decode(message)?;
    let calculated = hash_of(message);
    if calculated != state.header.state_hash {
        let StateHeader { step, state_hash: saved, .. } = state.header;
        return Err(StateError::Hash { step, saved, calculated });
    }
    Ok(state)
}

/// numpy's description of [`StateHeader`], as a JSON list.
pub const HEADER_DTYPE: &str =
    r#"[["step","<u8"],["sim_time_s","<f8"],["dissipated_energy_j","<f8"],["state_hash","V32"]]"#;

/// numpy's description of [`BodyState`], as a JSON list.
pub const BODY_DTYPE: &str = r#"[["position_m","<f8",[3]],["orientation","<f8",[4]],["linear_velocity_m_per_s","<f8",[3]],["angular_velocity_rad_per_s","<f8",[3]]]"#;

/// numpy's description of [`ContactState`], as a JSON list.
pub const CONTACT_DTYPE: &str = r#"[["body_a","<u4"],["body_b","<u4"],["arc","<u4"],["reserved","<u4"],["mid_cos","<f8"],["mid_sin","<f8"],["spring_m","<f8",[3]]]"#;

/// The hash of the three descriptions: logs with different layouts are never compared byte by byte.
pub fn layout_hash() -> Hash {
    Hash::of_parts(&[HEADER_DTYPE.as_bytes(), BODY_DTYPE.as_bytes(), CONTACT_DTYPE.as_bytes()])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn sample() -> StateMessage {
        let body = |k: f64| BodyState {
            position_m: [k, 2.0 * k, -k],
            orientation: [0.0, 0.0, 0.0, 1.0],
            linear_velocity_m_per_s: [0.1, 0.2, 0.3],
            angular_velocity_rad_per_s: [1.0, 2.0, 3.0],
        };
        let contact =
            ContactState { body_a: 0, body_b: 1, mid_cos: 1.0, spring_m: [1e-3; 3], ..Default::default() };
        let header =
            StateHeader { step: 7, sim_time_s: 0.5, dissipated_energy_j: 0.25, state_hash: Hash::default() };
        StateMessage { header, bodies: vec![body(1.0), body(2.0)], contacts: vec![contact] }
    }

    #[test]
    fn raw_image_equals_bincode() {
        let mut state = sample();
        let mut message = Vec::new();
        state.header.state_hash = encode(&state.header, &state.bodies, &state.contacts, &mut message);
        assert_eq!(message, wire::encode(&state));
        assert_eq!(message.len(), 56 + 8 + 2 * 104 + 8 + 56);
        assert_eq!(decode(&message).unwrap(), state);
        assert_eq!(decode_header(&message).unwrap(), state.header);
    }

    #[test]
    fn golden_bytes() {
        let header = StateHeader { step: 1, sim_time_s: 0.5, ..Default::default() };
        let mut message = Vec::new();
        encode(&header, &[], &[], &mut message);
        assert_eq!(
            message[..24],
            [1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0xe0, 0x3f, 0, 0, 0, 0, 0, 0, 0, 0]
        );
        assert_eq!(message[56..], [0; 16]);
    }

    #[test]
    fn every_flipped_bit_and_every_cut_is_an_error() {
        let state = sample();
        let mut message = Vec::new();
        encode(&state.header, &state.bodies, &state.contacts, &mut message);
        for cut in 0..message.len() {
            assert!(decode(&message[..cut]).is_err(), "cut at {cut}");
        }
        for bit in 0..message.len() * 8 {
            let mut broken = message.clone();
            broken[bit / 8] ^= 1 << (bit % 8);
            assert!(decode(&broken).is_err(), "bit {bit}");
        }
    }
}
