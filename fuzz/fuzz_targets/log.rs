//! Any bytes as a log: opened, read to the end and recovered, without a panic, an endless loop or a length believed.

#![no_main]

use libfuzzer_sys::fuzz_target;
use recorder::recover::recover_bytes;
use recorder::{Glance, Health, Log, Summary};

fuzz_target!(|data: &[u8]| {
    // Half of the inputs have their checksums set right, or hardly any mutation would get past them.
    let mut bytes = data.to_vec();
    if bytes.pop().is_some_and(|flag| flag & 1 == 1) {
        seal(&mut bytes);
    }
    if let Ok(log) = Log::from_bytes("fuzz", bytes.clone()) {
        let _ = (Glance::of(&log), Summary::of(&log));
        for step in [0, 1, u64::MAX] {
            let _ = (log.state(step), log.state_at_or_before(step), log.frame(step as usize));
        }
    }
    if let Ok((made, recovery)) = recover_bytes(&bytes, &mut || Ok(Vec::new()), None) {
        // What is recovered is whole, whatever it was made of.
        let log = Log::from_bytes("recovered", made).expect("a log");
        log.check(&mut |_, _| {}).expect("all promises kept");
        assert_eq!(log.health(), Health::Complete);
        assert_eq!(log.count(recorder::Kind::Step) as u64, recovery.counts.step_records);
    }
});

/// Sets the checksums of all chunks, of the data section and of the index right.
fn seal(bytes: &mut [u8]) {
    let (mut offset, mut summary) = (8, None);
    while let Some(head) = bytes.get(offset..).and_then(|rest| rest.first_chunk::<9>()) {
        let length = u64::from_le_bytes(head[1..].try_into().expect("eight bytes"));
        let start = offset + 9;
        let Some(end) = usize::try_from(length).ok().and_then(|length| start.checked_add(length)) else { return };
        if end > bytes.len() {
            return;
        }
        match head[0] {
            0x06 if length >= 40 => {
                let crc = crc32fast::hash(&bytes[start + 40..end]);
                bytes[start + 24..start + 28].copy_from_slice(&crc.to_le_bytes());
            }
            0x0F if length == 4 => {
                let crc = crc32fast::hash(&bytes[..offset]);
                bytes[start..end].copy_from_slice(&crc.to_le_bytes());
                summary = Some(end);
            }
            0x02 if length == 20 => {
                let Some(summary) = summary else { return };
                let crc = crc32fast::hash(&bytes[summary..end - 4]);
                bytes[end - 4..end].copy_from_slice(&crc.to_le_bytes());
                return;
            }
            _ => {}
        }
        offset = end;
    }
}
