//! The name of a bus, and the places in the file system that follow from it.

use crate::BusError;
use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;
use std::sync::atomic::{AtomicU32, Ordering};
use std::time::{SystemTime, UNIX_EPOCH};

/// Characters that a bus name may have at most.
///
/// The wake-up sockets lie in the bus's directory, and a socket's path has at most 107 bytes on Linux:
/// a longer name leaves too little for the temporary directory in front of it.
pub const NAME_LENGTH_MAX: usize = 24;

/// What the names of the buses' directories begin with.
pub(crate) const NAME_PREFIX: &str = "chainmail-";

/// The name that all processes of one run share; processes on different names never meet.
///
/// 1 to 24 characters, each an ASCII letter, a digit, `-` or `_`.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BusName(String);

impl BusName {
    /// A name that no other bus of this machine has: process number, a counter and the time of day.
    ///
    /// It only names files that are gone after the run; it never reaches a message.
    pub fn unique() -> Self {
        static COUNTER: AtomicU32 = AtomicU32::new(0);
        let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
        // 32 bits of microseconds come again after 71 minutes, and then with another process number.
        let time = since_1970.as_micros() & 0xffff_ffff;
        let counter = COUNTER.fetch_add(1, Ordering::Relaxed) & 0xffff;
        BusName(format!("u{:x}-{counter:x}-{time:x}", std::process::id()))
    }

    /// The name as text.
    pub fn as_str(&self) -> &str {
        &self.0
    }

    /// The directory of the bus's small files: `chainmail-NAME` in the temporary directory. Processes with
    /// different temporary directories (`TMPDIR`) do not meet.
    pub fn root_dir(&self) -> PathBuf {
        std::env::temp_dir().join(format!("{NAME_PREFIX}{}", self.0))
    }

    /// What the names of the bus's shared-memory files begin with: `cm`, 12 hexadecimal digits, `_`.
    ///
    /// The digits are the low 48 bits of the name's FNV-1a hash, because the name itself would make the
    /// path of a socket too long.
    pub fn shared_memory_prefix(&self) -> String {
        let mut hash = 0xcbf2_9ce4_8422_2325_u64;
        for byte in self.0.bytes() {
            hash = (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3);
        }
        format!("cm{:012x}_", hash & 0xffff_ffff_ffff)
    }
}

impl fmt::Display for BusName {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl FromStr for BusName {
    type Err = BusError;

    fn from_str(text: &str) -> Result<Self, BusError> {
        let allowed = |byte: u8| byte.is_ascii_alphanumeric() || byte == b'-' || byte == b'_';
        if text.is_empty() || text.len() > NAME_LENGTH_MAX || !text.bytes().all(allowed) {
            return Err(BusError::BadName { name: text.to_owned() });
        }
        Ok(BusName(text.to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_that_are_parsed_and_names_that_are_refused() {
        for good in ["a", "run_1", "A-b-9", "123456789012345678901234"] {
            assert_eq!(good.parse::<BusName>().unwrap().to_string(), good);
        }
        for bad in ["", "a b", "a/b", "..", "ä", "1234567890123456789012345", "a\n"] {
            let message = bad.parse::<BusName>().unwrap_err().to_string();
            assert!(message.contains(&format!("{bad:?}")) && message.contains("1 to 24"), "{message}");
        }
    }

    #[test]
    fn unique_names_differ_and_parse() {
        let names: std::collections::BTreeSet<_> = (0..1000).map(|_| BusName::unique()).collect();
        assert_eq!(names.len(), 1000);
        for name in names {
            assert_eq!(name.as_str().parse::<BusName>().unwrap(), name);
        }
    }

    #[test]
    fn prefixes_have_one_length_so_that_none_begins_another() {
        let prefixes: std::collections::BTreeSet<_> =
            ["a", "a-", "a-b", "b"].map(|name| BusName(name.to_owned()).shared_memory_prefix()).into();
        assert_eq!(prefixes.len(), 4);
        assert!(prefixes.iter().all(|prefix| prefix.len() == 15));
    }
}
