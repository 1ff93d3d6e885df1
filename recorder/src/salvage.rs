//! What a broken file still holds: every chunk whose checksum is right, wherever it lies.
//!
//! The one thing to know: only bytes under a checksum are believed. Where the bytes are not what a container holds, the
//! next whole chunk is looked for byte by byte, so one wrong length costs no more than the chunk it is in.

use crate::container::{ChannelRecord, Chunk, Damage, Fields, MAGIC, MessageRecord, op, record_at};
use crate::fault::LogProblem;
use crate::index::summary_section;
use crate::message::{Kind, Message};
use schemas::state;
use serde::Serialize;

/// Bytes of a file that no checksum vouches for.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct Loss {
    /// Where they begin.
    pub offset: u64,
    /// How many they are.
    pub bytes: u64,
    /// What is there and what was expected.
    pub what: String,
    /// Whether they are past all messages: an index, which is made again.
    pub is_index: bool,
}

/// A message in a whole chunk.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Find {
    pub kind: Kind,
    /// Its number on its channel: as MCAP counts, with the laps that 32 bits leave out.
    pub number: u64,
    /// Offset of its record in the file, and of the byte after it.
    pub place: (usize, usize),
}

/// What a file still holds.
#[derive(Debug, Default)]
pub(crate) struct Salvage {
    /// Messages in file order; the numbers of a kind ascend.
    pub finds: Vec<Find>,
    pub losses: Vec<Loss>,
    pub has_renderer: bool,
    channels: Vec<(u16, Kind)>,
    /// The number that the next message of a kind should have.
    next: [u64; 6],
}

/// Looks through a file for what is whole.
///
/// # Errors
///
/// [`LogProblem::NotMcap`], [`LogProblem::Layout`].
pub(crate) fn salvage(file: &[u8]) -> Result<Salvage, LogProblem> {
    let mut salvage = Salvage::default();
    // One wrong byte in the first eight costs nothing.
    let wrong_bytes = file.iter().zip(&MAGIC).filter(|(a, b)| a != b).count();
    if file.len() < MAGIC.len() || wrong_bytes > 1 {
        return Err(LogProblem::NotMcap { found: file[..file.len().min(MAGIC.len())].to_vec() });
    }
    // Looking for a chunk costs a checksum wherever bytes look like the head of one. In a file that was made to cost
    // much, that ends somewhere.
    let mut patience = 8 * file.len() as u64;
    let mut offset = MAGIC.len().min(file.len());
    while offset < file.len() {
        let what = match salvage.step_over(file, offset) {
            Ok(Some(end)) => {
                offset = end;
                continue;
            }
            Ok(None) => break,
            Err(Trouble::Layout(found)) => {
                return Err(LogProblem::Layout { found, expected: state::layout_hash().to_string() });
            }
            Err(Trouble::Damage(damage)) => damage.what,
        };
        let next = next_chunk(file, offset + 1, &mut patience);
        let is_index = next == file.len() && salvage.next[Kind::End.index()] > 0;
        salvage.losses.push(Loss { offset: offset as u64, bytes: (next - offset) as u64, what, is_index });
        offset = next;
    }
    Ok(salvage)
}

enum Trouble {
    Damage(Damage),
    /// Another layout of the states.
    Layout(String),
}

impl From<Damage> for Trouble {
    fn from(damage: Damage) -> Trouble {
        Trouble::Damage(damage)
    }
}

impl Salvage {
    /// Takes in one record of the data section; the offset after it, or `None` at the file's proper end.
    fn step_over(&mut self, file: &[u8], offset: usize) -> Result<Option<usize>, Trouble> {
        let record = record_at(file, offset, file.len())?;
        let mut body = record.body;
        match record.opcode {
            op::HEADER if offset == MAGIC.len() => {
                let _profile_and_library = (body.text()?, body.text()?);
            }
            op::CHUNK => {
                let chunk = Chunk::parse(record, offset)?;
                chunk.check(file)?;
                self.enter(file, chunk)?;
                body = Fields::new(file, record.end, record.end);
            }
            op::MESSAGE_INDEX => {
                body.u16()?;
                let places = body.part()?;
                let bytes = record.end - places.position();
                if bytes % 16 != 0 {
                    return Err(Damage::at(offset, format!("a message index of {bytes} bytes")).into());
                }
            }
            op::DATA_END => {
                body.u32()?;
                match summary_section(file) {
                    Ok((summary, _)) if summary == record.end => return Ok(None),
                    Ok(_) => return Err(Damage::at(record.end, "the index lies elsewhere").into()),
                    Err(damage) => return Err(damage.into()),
                }
            }
            opcode => {
                let what = format!("a record with opcode {opcode:#04x} where a chunk was expected");
                return Err(Damage::at(offset, what).into());
            }
        }
        if !body.is_empty() {
            return Err(Damage::at(offset, "a record that is longer than what is in it").into());
        }
        Ok(Some(record.end))
    }

    /// Takes in the messages of a chunk whose checksum is right.
    fn enter(&mut self, file: &[u8], chunk: Chunk) -> Result<(), Trouble> {
        let mut offset = chunk.start;
        while offset < chunk.end {
            let record = record_at(file, offset, chunk.end)?;
            match record.opcode {
                op::CHANNEL => self.add_channel(ChannelRecord::parse(record)?)?,
                op::MESSAGE => {
                    let message = MessageRecord::parse(record)?;
                    if let Some(kind) = self.kind_of(message.channel_id) {
                        self.add_message(kind, message.sequence, (offset, record.end));
                    }
                }
                _ => {}
            }
            offset = record.end;
        }
        Ok(())
    }

    fn add_channel(&mut self, channel: ChannelRecord) -> Result<(), Trouble> {
        let Some(kind) = Kind::of_topic(channel.topic) else { return Ok(()) };
        if kind == Kind::State && channel.layout_hash != Some(&state::layout_hash().to_string()) {
            return Err(Trouble::Layout(channel.layout_hash.unwrap_or("not given").to_owned()));
        }
        self.has_renderer |= kind == Kind::Frame;
        if self.kind_of(channel.id).is_none() {
            self.channels.push((channel.id, kind));
        }
        Ok(())
    }

    /// Takes in a message, unless it is one that has passed.
    fn add_message(&mut self, kind: Kind, sequence: u32, place: (usize, usize)) {
        let next = &mut self.next[kind.index()];
        let ahead = sequence.wrapping_sub(*next as u32);
        if ahead < 1 << 31 {
            let number = *next + u64::from(ahead);
            *next = number + 1;
            self.finds.push(Find { kind, number, place });
        }
    }

    fn kind_of(&self, channel_id: u16) -> Option<Kind> {
        self.channels.iter().find(|(id, _)| *id == channel_id).map(|&(_, kind)| kind)
    }
}

impl Find {
    /// The message, from the file that it was found in.
    pub fn message<'a>(&self, file: &'a [u8]) -> Message<'a> {
        let (offset, end) = self.place;
        let record = record_at(file, offset, end).and_then(MessageRecord::parse);
        let record = record.unwrap_or_else(|damage| panic!("it was read before: {damage:?}"));
        Message::new(self.kind, record.log_time_ns, record.bytes)
    }
}

/// The offset of the first whole chunk at or after `from`, or the file's length.
fn next_chunk(file: &[u8], from: usize, patience: &mut u64) -> usize {
    for offset in from..file.len() {
        if file[offset] != op::CHUNK {
            continue;
        }
        let Ok(chunk) = record_at(file, offset, file.len()).and_then(|record| Chunk::parse(record, offset))
        else {
            continue;
        };
        let cost = (chunk.end - offset) as u64;
        if cost > *patience {
            break;
        }
        *patience -= cost;
        if chunk.check(file).is_ok() {
            return offset;
        }
    }
    file.len()
}
