//! Where the messages of a log lie: from its own index, or by walking through it.

use crate::container::{
    ChannelRecord, Chunk, Damage, FOOTER_BYTES, Fields, MAGIC, MessageRecord, RECORD_HEAD_BYTES,
    message_counts, op, record_at,
};
use crate::fault::LogProblem;
use crate::message::{Kind, Message};
use schemas::state;

/// Where one message lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Offset of its record in the file.
    pub offset: u64,
    /// Number of its chunk.
    pub chunk: u32,
    /// Its number on its channel, as MCAP counts: modulo 2^32.
    sequence: u32,
    kind: Kind,
}

/// Where everything lies.
#[derive(Debug, Default)]
pub(crate) struct Index {
    pub chunks: Vec<Chunk>,
    /// Messages in file order.
    pub entries: Vec<Entry>,
    /// Numbers of the entries of each kind.
    pub by_kind: [Vec<usize>; 6],
    /// Whether frames have channels.
    pub has_renderer: bool,
    /// Why there is no more than this.
    pub damage: Option<Damage>,
    channels: Vec<(u16, Kind)>,
    has_channels: bool,
    /// Offset of the data end record.
    data_end: Option<usize>,
}

/// Finds the messages of a file, and says whether their chunks' checksums were compared on the way.
pub(crate) fn index_of(file: &[u8]) -> Result<(Index, bool), LogProblem> {
    if file.len() < MAGIC.len() || file[..MAGIC.len()] != MAGIC {
        return Err(LogProblem::NotMcap { found: file[..file.len().min(MAGIC.len())].to_vec() });
    }
    let (index, are_checked) = match Index::read(file) {
        Ok(index) => (index, false),
        Err(Failure::Layout(found)) => return Err(layout_problem(found)),
        Err(Failure::Damage(damage)) => (Index::scan(file, damage)?, true),
    };
    if index.has_channels && !index.channels.iter().any(|&(_, kind)| kind == Kind::Scene) {
        return Err(LogProblem::NotALog);
    }
    Ok((index, are_checked))
}

enum Failure {
    Damage(Damage),
    /// Another layout of the states, with the hash in the log.
    Layout(String),
}

impl From<Damage> for Failure {
    fn from(damage: Damage) -> Failure {
        Failure::Damage(damage)
    }
}

fn layout_problem(found: String) -> LogProblem {
    LogProblem::Layout { found, expected: state::layout_hash().to_string() }
}

impl Index {
    /// Reads the summary section at the end of the file and the message indexes that it leads to.
    fn read(file: &[u8]) -> Result<Index, Failure> {
        let mut index = Index::default();
        let (summary, footer) = summary_section(file)?;
        let mut offset = summary;
        let (mut chunk_indexes, mut counts) = (Vec::new(), Vec::new());
        while offset < footer {
            let record = record_at(file, offset, footer)?;
            match record.opcode {
                op::CHANNEL => index.add_channel(record)?,
                op::CHUNK_INDEX => chunk_indexes.push(record.body),
                op::STATISTICS => counts = message_counts(record)?,
                _ => {}
            }
            offset = record.end;
        }
        for mut body in chunk_indexes {
            index.read_chunk_index(file, &mut body, summary)?;
        }
        index.find_data_end(file, summary)?;
        // The message indexes in the data section have no checksum of their own; this count has.
        for kind in Kind::ALL {
            let of_kind = |&&(id, _): &&(u16, u64)| index.kind_of(id) == Some(kind);
            let expected: u64 = counts.iter().filter(of_kind).map(|&(_, count)| count).sum();
            let got = index.by_kind[kind.index()].len();
            if got as u64 != expected {
                let what =
                    format!("the message indexes name {got} {kind} messages, the statistics {expected}");
                return Err(Damage::at(summary, what).into());
            }
        }
        Ok(index)
    }

    /// Enters the messages of one chunk, as its message indexes give them.
    fn read_chunk_index(&mut self, file: &[u8], body: &mut Fields, limit: usize) -> Result<(), Damage> {
        let here = body.position();
        let _times_ns = (body.u64()?, body.u64()?);
        let offset = within(body.u64()?, limit, here)?;
        let record = record_at(file, offset, limit)?;
        if record.opcode != op::CHUNK {
            return Err(Damage::at(here, format!("the index names a chunk at byte {offset}, where none is")));
        }
        let chunk = Chunk::parse(record, offset)?;
        let _length = body.u64()?;
        let _offsets = body.part()?;
        let indexes_end = within(body.u64()?.saturating_add(record.end as u64), limit, here)?;
        let first = self.entries.len();
        let chunk_number = self.chunks.len() as u32;
        let mut at = record.end;
        while at < indexes_end {
            let record = record_at(file, at, indexes_end)?;
            at = record.end;
            if record.opcode != op::MESSAGE_INDEX {
                continue;
            }
            let mut body = record.body;
            let Some(kind) = self.kind_of(body.u16()?) else { continue };
            let mut places = body.part()?;
            while !places.is_empty() {
                let here = places.position();
                let _log_time_ns = places.u64()?;
                let place = within(places.u64()?.saturating_add(chunk.start as u64), chunk.end, here)?;
                let (offset, sequence) = (place as u64, 0);
                self.entries.push(Entry { offset, chunk: chunk_number, sequence, kind });
            }
        }
        self.chunks.push(chunk);
        self.entries[first..].sort_unstable_by_key(|entry| entry.offset);
        for number in first..self.entries.len() {
            self.number(number);
        }
        Ok(())
    }

    /// Walks through a file that has no usable index, up to the first damage.
    fn scan(file: &[u8], why_no_index: Damage) -> Result<Index, LogProblem> {
        let mut index = Index::default();
        let mut offset = MAGIC.len();
        let damage = loop {
            match index.scan_record(file, offset) {
                Ok(Some(end)) => offset = end,
                // The data is whole, so the damage is that of the index.
                Ok(None) => break why_no_index,
                Err(Failure::Layout(found)) => return Err(layout_problem(found)),
                Err(Failure::Damage(damage)) if damage.cut => {
                    break Damage { offset: offset as u64, ..damage };
                }
                Err(Failure::Damage(damage)) => break damage,
            }
        };
        index.damage = Some(damage);
        Ok(index)
    }

    /// Enters one record of the data section; the offset after it, or `None` at the section's end.
    fn scan_record(&mut self, file: &[u8], offset: usize) -> Result<Option<usize>, Failure> {
        let record = record_at(file, offset, file.len())?;
        match record.opcode {
            op::CHANNEL => self.add_channel(record)?,
            op::CHUNK => {
                let chunk = Chunk::parse(record, offset)?;
                chunk.check(file)?;
                self.scan_chunk(file, chunk)?;
            }
            op::DATA_END => {
                self.data_end = Some(offset);
                return Ok(None);
            }
            _ => {}
        }
        Ok(Some(record.end))
    }

    fn scan_chunk(&mut self, file: &[u8], chunk: Chunk) -> Result<(), Failure> {
        let chunk_number = self.chunks.len() as u32;
        self.chunks.push(chunk);
        let mut offset = chunk.start;
        while offset < chunk.end {
            let record = record_at(file, offset, chunk.end)?;
            match record.opcode {
                op::CHANNEL => self.add_channel(record)?,
                op::MESSAGE => {
                    let message = MessageRecord::parse(record)?;
                    if let Some(kind) = self.kind_of(message.channel_id) {
                        let entry = Entry { offset: offset as u64, chunk: chunk_number, sequence: 0, kind };
                        self.entries.push(entry);
                        self.number(self.entries.len() - 1);
                    }
                }
                _ => {}
            }
            offset = record.end;
        }
        Ok(())
    }

    fn add_channel(&mut self, record: crate::container::Record) -> Result<(), Failure> {
        let channel = ChannelRecord::parse(record)?;
        self.has_channels = true;
        let Some(kind) = Kind::of_topic(channel.topic) else { return Ok(()) };
        if kind == Kind::State && channel.layout_hash != Some(&state::layout_hash().to_string()) {
            return Err(Failure::Layout(channel.layout_hash.unwrap_or("not given").to_owned()));
        }
        self.has_renderer |= kind == Kind::Frame;
        if self.kind_of(channel.id).is_none() {
            self.channels.push((channel.id, kind));
        }
        Ok(())
    }

    fn kind_of(&self, channel_id: u16) -> Option<Kind> {
        self.channels.iter().find(|(id, _)| *id == channel_id).map(|&(_, kind)| kind)
    }

    /// Gives an entry its number on its channel.
    fn number(&mut self, entry: usize) {
        let kind = self.entries[entry].kind;
        let of_kind = &mut self.by_kind[kind.index()];
        self.entries[entry].sequence = of_kind.len() as u32;
        of_kind.push(entry);
    }

    /// Finds the data end record, the last before the summary section.
    fn find_data_end(&mut self, file: &[u8], summary: usize) -> Result<(), Damage> {
        let offset = summary.saturating_sub(RECORD_HEAD_BYTES + 4);
        let record = record_at(file, offset, summary)?;
        if record.opcode != op::DATA_END || record.end != summary {
            return Err(Damage::at(offset, "no data end record lies before the index"));
        }
        self.data_end = Some(offset);
        Ok(())
    }

    /// Compares a chunk's checksum, and its message indexes with the messages in it.
    pub fn check_chunk(&self, file: &[u8], number: usize) -> Result<(), Damage> {
        let chunk = self.chunks[number];
        chunk.check(file)?;
        let first = self.entries.partition_point(|entry| (entry.chunk as usize) < number);
        let mut entries = self.entries[first..].iter().take_while(|entry| entry.chunk as usize == number);
        let mut offset = chunk.start;
        while offset < chunk.end {
            let record = record_at(file, offset, chunk.end)?;
            if record.opcode == op::MESSAGE
                && self.kind_of(MessageRecord::parse(record)?.channel_id).is_some()
                && entries.next().is_none_or(|entry| entry.offset != offset as u64)
            {
                return Err(Damage::at(offset, "the chunk's message index does not lead to this message"));
            }
            offset = record.end;
        }
        Ok(())
    }

    /// Compares the checksum over the whole data section.
    pub fn check_data(&self, file: &[u8]) -> Result<(), Damage> {
        let Some(offset) = self.data_end else {
            return Err(Damage::at(file.len(), "no data end record"));
        };
        let saved = record_at(file, offset, file.len())?.body.u32()?;
        let calculated = crc32fast::hash(&file[..offset]);
        if saved == calculated {
            return Ok(());
        }
        let what = format!("the data section's CRC is {saved:08x}, but its bytes give {calculated:08x}");
        Err(Damage::at(offset, what))
    }

    /// Reads a message; its chunk's checksum is the caller's business.
    pub fn message<'a>(&self, file: &'a [u8], entry: usize) -> Result<Message<'a>, Damage> {
        let Entry { offset, chunk, sequence, kind } = self.entries[entry];
        let offset = offset as usize;
        let record = record_at(file, offset, self.chunks[chunk as usize].end)?;
        if record.opcode != op::MESSAGE {
            let opcode = record.opcode;
            return Err(Damage::at(
                offset,
                format!("a record with opcode {opcode:#04x} where a message was expected"),
            ));
        }
        let message = MessageRecord::parse(record)?;
        if self.kind_of(message.channel_id) != Some(kind) || message.sequence != sequence {
            let (id, got) = (message.channel_id, message.sequence);
            let what = format!("message {got} of channel {id}, where {kind} message {sequence} was expected");
            return Err(Damage::at(offset, what));
        }
        Ok(Message::new(kind, message.log_time_ns, message.bytes))
    }
}

/// The offsets at which the summary section begins and the footer lies, its checksum compared.
pub(crate) fn summary_section(file: &[u8]) -> Result<(usize, usize), Damage> {
    let end = file.len();
    if end < MAGIC.len() + FOOTER_BYTES || file[end - MAGIC.len()..] != MAGIC {
        let what = "the file does not end as an MCAP file does";
        return Err(Damage { cut: true, ..Damage::at(end, what) });
    }
    let footer = end - FOOTER_BYTES;
    let record = record_at(file, footer, end)?;
    if record.opcode != op::FOOTER || record.end != end - MAGIC.len() {
        return Err(Damage::at(footer, "no footer record lies before the end"));
    }
    let mut body = record.body;
    let summary = within(body.u64()?, footer, footer)?;
    let _summary_offsets = body.u64()?;
    let checked_end = body.position();
    let saved = body.u32()?;
    let calculated = crc32fast::hash(&file[summary..checked_end]);
    if saved != calculated {
        let what = format!("the index's CRC is {saved:08x}, but its bytes give {calculated:08x}");
        return Err(Damage::at(summary, what));
    }
    Ok((summary, footer))
}

/// A file offset that must lie before a limit; `here` is where it was read.
fn within(offset: u64, limit: usize, here: usize) -> Result<usize, Damage> {
    match usize::try_from(offset) {
        Ok(offset) if offset <= limit => Ok(offset),
        _ => Err(Damage::at(here, format!("an offset of {offset}, beyond {limit}"))),
    }
}
