//! The one place that knows bincode: fixed-width little-endian records (`bincode` 2.0.1, `config::legacy()`,
//! byte for byte the format of bincode 1).
//!
//! Layout: integers and floats in their own width, little-endian; a sequence is a `u64` length and its
//! elements; an `Option` is one byte and its value; an enum is a `u32` variant number and its fields; an
//! array has no length. Nothing is padded.

use serde::{Serialize, de::DeserializeOwned};

/// A record that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum WireError {
    /// The bytes end too early, or hold a value that the type does not allow.
    #[error("a {type_name} record of {length} bytes cannot be read: {source}")]
    Malformed {
        /// The type that was asked for.
        type_name: &'static str,
        /// How many bytes there were.
        length: usize,
        /// What the codec said.
        source: Box<bincode::error::DecodeError>,
    },
    /// The record is complete before its bytes are.
    #[error("a {type_name} record takes {used} bytes, but {length} were given")]
    TrailingBytes {
        /// The type that was asked for.
        type_name: &'static str,
        /// Bytes that the record takes.
        used: usize,
        /// Bytes that were given.
        length: usize,
    },
}

/// Writes a record.
///
/// # Panics
///
/// If the type cannot be written at all (an untagged or borrowed shape): a programmer's error.
pub fn encode<T: Serialize>(value: &T) -> Vec<u8> {
    bincode::serde::encode_to_vec(value, bincode::config::legacy())
        .expect("every record type of this crate has a fixed layout")
}

/// Reads a record; every byte must be used.
///
/// # Errors
///
/// [`WireError`] if the bytes are too short, too long, or not a value of the type. A length that promises
/// more than the record type's limit (64 MiB) is refused before anything is allocated for it.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, WireError> {
    const RECORD_BYTES_MAX: usize = 64 << 20;
    let type_name = std::any::type_name::<T>();
    let config = bincode::config::legacy().with_limit::<RECORD_BYTES_MAX>();
    let (value, used) = bincode::serde::decode_from_slice(bytes, config).map_err(|source| {
        WireError::Malformed { type_name, length: bytes.len(), source: Box::new(source) }
    })?;
    if used != bytes.len() {
        return Err(WireError::TrailingBytes { type_name, used, length: bytes.len() });
    }
    Ok(value)
}
