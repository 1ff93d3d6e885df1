//! A number of bounces, or `"unlimited"`.

use serde::{Deserializer, Serializer, de};
use std::fmt;

/// `bounces_max` of a path that only Russian roulette ends.
pub const UNLIMITED: u32 = u32::MAX;

const WORD: &str = "unlimited";

pub(super) fn serialize<S: Serializer>(bounces: &u32, serializer: S) -> Result<S::Ok, S::Error> {
    if *bounces == UNLIMITED { serializer.serialize_str(WORD) } else { serializer.serialize_u32(*bounces) }
}

pub(super) fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<u32, D::Error> {
    deserializer.deserialize_any(Bounces)
}

struct Bounces;

impl de::Visitor<'_> for Bounces {
    type Value = u32;

    fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
        formatter.write_str("a number of bounces, or \"unlimited\"")
    }

    fn visit_i64<E: de::Error>(self, value: i64) -> Result<u32, E> {
        u32::try_from(value).map_err(|_| E::invalid_value(de::Unexpected::Signed(value), &self))
    }

    fn visit_u64<E: de::Error>(self, value: u64) -> Result<u32, E> {
        u32::try_from(value).map_err(|_| E::invalid_value(de::Unexpected::Unsigned(value), &self))
    }

    fn visit_str<E: de::Error>(self, value: &str) -> Result<u32, E> {
        if value == WORD {
            return Ok(UNLIMITED);
        }
        Err(E::invalid_value(de::Unexpected::Str(value), &self))
    }
}
