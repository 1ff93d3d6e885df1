//! Where the messages of a log lie: from its own index, or by walking through it.
//!
//! The one thing to know: opening a finished log reads its summary section and nothing else, and holds a line a chunk.
//! Where the messages of a chunk lie is found by walking through the chunk when one of them is asked for.

use crate::container::{
    ChannelRecord, Chunk, Damage, FOOTER_BYTES, Fields, MAGIC, MessageRecord, RECORD_HEAD_BYTES,
    message_counts, op, record_at,
};
use crate::container_writer::CHUNK_HEAD_BYTES;
use crate::fault::LogProblem;
use crate::message::{Kind, Message};
use schemas::state;

/// Where one message lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry {
    /// Offset of its record in the file.
    pub offset: u64,
    pub kind: Kind,
    /// Its number on its channel.
    pub number: u64,
}

/// The messages of one chunk.
#[derive(Debug, Default)]
pub(crate) struct Entries {
    /// In file order.
    pub all: Vec<Entry>,
    /// The places of each kind in `all`.
    pub by_kind: [Vec<u32>; 6],
    /// Why there are no more.
    pub damage: Option<Damage>,
}

/// Where everything lies.
#[derive(Debug, Default)]
pub(crate) struct Index {
    /// Where each chunk's records begin and end.
    pub chunks: Vec<Place>,
    /// Of each chunk: how many messages of each kind lie in the chunks up to its end.
    through: Vec<[u64; 6]>,
    /// Whether frames have channels.
    pub has_renderer: bool,
    /// Why there is no more than this.
    pub damage: Option<Damage>,
    channels: Vec<(u16, Kind)>,
    has_channels: bool,
    /// Offset of the data end record.
    data_end: Option<usize>,
}

/// Where a chunk lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Place {
    /// Offset of the chunk record.
    pub offset: usize,
    /// Offset of the byte after it.
    pub end: usize,
}

impl Place {
    /// Offset of the first record in it.
    pub fn start(self) -> usize {
        self.offset + CHUNK_HEAD_BYTES
    }
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
            index.add_chunk(&mut body, summary)?;
        }
        index.find_data_end(file, summary)?;
        // Two accounts of the same, both under the summary's checksum.
        for kind in Kind::ALL {
            let of_kind = |&&(id, _): &&(u16, u64)| index.kind_of(id) == Some(kind);
            let expected: u64 = counts.iter().filter(of_kind).map(|&(_, count)| count).sum();
            let got = index.count(kind);
            if got != expected {
                let what =
                    format!("the message indexes name {got} {kind} messages, the statistics {expected}");
                return Err(Damage::at(summary, what).into());
            }
        }
        Ok(index)
    }

    /// Enters a chunk as the index gives it. The chunk itself is not looked at; how many messages it has follows from the
    /// lengths of its message indexes, which lie behind it, one after the other.
    fn add_chunk(&mut self, body: &mut Fields, limit: usize) -> Result<(), Damage> {
        const MESSAGE_INDEX_HEAD_BYTES: u64 = RECORD_HEAD_BYTES as u64 + 2 + 4;
        let here = body.position();
        let _times_ns = (body.u64()?, body.u64()?);
        let offset = within(body.u64()?, limit, here)?;
        let end = within(body.u64()?.saturating_add(offset as u64), limit, here)?;
        let mut offsets = body.part()?;
        let mut places = Vec::new();
        while !offsets.is_empty() {
            let (channel_id, place) = (offsets.u16()?, offsets.u64()?);
            places.push((place, channel_id));
        }
        places.sort_unstable();
        let indexes_end = within(body.u64()?.saturating_add(end as u64), limit, here)? as u64;
        let compression = body.text()?;
        if !compression.is_empty() {
            return Err(Damage::at(offset, format!("{}: \"{compression}\"", Chunk::COMPRESSED)));
        }
        // Each byte is in one chunk at the most: reading all of them costs no more than the file is long.
        if self.chunks.last().is_some_and(|last| offset < last.end) {
            return Err(Damage::at(here, format!("the index names chunks that overlap at byte {offset}")));
        }
        if end - offset < CHUNK_HEAD_BYTES {
            return Err(Damage::at(here, format!("the index names a chunk of {} bytes", end - offset)));
        }
        let mut counts = self.through.last().copied().unwrap_or_default();
        for (number, &(place, channel_id)) in places.iter().enumerate() {
            let next = places.get(number + 1).map_or(indexes_end, |&(next, _)| next);
            let bytes = next.checked_sub(place).and_then(|bytes| bytes.checked_sub(MESSAGE_INDEX_HEAD_BYTES));
            let Some(bytes) = bytes.filter(|bytes| bytes.is_multiple_of(16) && place >= end as u64) else {
                return Err(Damage::at(here, format!("a message index at byte {place} that does not fit")));
            };
            // The smallest message takes more than two bytes of the chunk for each of its index.
            if bytes / 16 > (end - offset) as u64 {
                return Err(Damage::at(here, "more messages than the chunk has room for"));
            }
            if let Some(kind) = self.kind_of(channel_id) {
                counts[kind.index()] += bytes / 16;
            }
        }
        self.chunks.push(Place { offset, end });
        self.through.push(counts);
        Ok(())
    }

    /// How many messages a channel has.
    pub fn count(&self, kind: Kind) -> u64 {
        self.through.last().map_or(0, |through| through[kind.index()])
    }

    /// How many messages lie in the chunks before one.
    fn before(&self, chunk: usize) -> [u64; 6] {
        chunk.checked_sub(1).map_or([0; 6], |chunk| self.through[chunk])
    }

    /// The chunk of a channel's message, and which of the chunk's messages of this kind it is.
    pub fn place(&self, kind: Kind, index: u64) -> Option<(usize, u64)> {
        let chunk = self.through.partition_point(|through| through[kind.index()] <= index);
        (chunk < self.chunks.len()).then(|| (chunk, index - self.before(chunk)[kind.index()]))
    }

    /// The checksum that a chunk's head gives for its records; not compared.
    pub fn crc(&self, file: &[u8], number: usize) -> u32 {
        let place = self.chunks[number];
        Fields::new(file, place.offset + RECORD_HEAD_BYTES + 24, place.end).u32().unwrap_or_default()
    }

    /// Where the messages of a chunk lie, as far as its records are whole.
    pub fn entries(&self, file: &[u8], number: usize) -> Entries {
        let place = self.chunks[number];
        let mut entries = Entries::default();
        let mut numbers = self.before(number);
        let mut walk = || -> Result<(), Damage> {
            let mut offset = place.start();
            while offset < place.end {
                let record = record_at(file, offset, place.end)?;
                if record.opcode == op::MESSAGE
                    && let Some(kind) = self.kind_of(MessageRecord::parse(record)?.channel_id)
                {
                    let next = &mut numbers[kind.index()];
                    entries.by_kind[kind.index()].push(entries.all.len() as u32);
                    entries.all.push(Entry { offset: offset as u64, kind, number: *next });
                    *next += 1;
                }
                offset = record.end;
            }
            Ok(())
        };
        let walked = walk();
        entries.damage = walked.err().or_else(|| {
            let other = || Damage::at(place.offset, "the index counts other messages than the chunk holds");
            (numbers != self.through[number]).then(other)
        });
        entries
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
        let mut counts = self.through.last().copied().unwrap_or_default();
        let mut offset = chunk.start;
        while offset < chunk.end {
            let record = record_at(file, offset, chunk.end)?;
            match record.opcode {
                op::CHANNEL => self.add_channel(record)?,
                op::MESSAGE => {
                    let message = MessageRecord::parse(record)?;
                    if let Some(kind) = self.kind_of(message.channel_id) {
                        counts[kind.index()] += 1;
                    }
                }
                _ => {}
            }
            offset = record.end;
        }
        self.chunks.push(Place { offset: chunk.offset, end: chunk.end });
        self.through.push(counts);
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

    /// Compares a chunk's place and checksum with its head.
    pub fn check_chunk(&self, file: &[u8], number: usize) -> Result<(), Damage> {
        let place = self.chunks[number];
        let record = record_at(file, place.offset, file.len())?;
        if record.opcode != op::CHUNK || record.end != place.end {
            return Err(Damage::at(
                place.offset,
                "the index names a chunk here, where none of its length is",
            ));
        }
        let chunk = Chunk::parse(record, place.offset)?;
        chunk.check(file)
    }

    /// Compares the checksum over the whole data section, given that those of the chunks have been compared.
    pub fn check_data(&self, file: &[u8]) -> Result<(), Damage> {
        let Some(offset) = self.data_end else {
            return Err(Damage::at(file.len(), "no data end record"));
        };
        let saved = record_at(file, offset, file.len())?.body.u32()?;
        let mut crc = crc32fast::Hasher::new();
        let mut hashed = 0;
        for (number, place) in self.chunks.iter().enumerate() {
            if place.end > offset {
                return Err(Damage::at(place.offset, "a chunk that lies in the index"));
            }
            // The records in the chunk need not be hashed once more.
            let records = place.end - place.start();
            crc.update(&file[hashed..place.start()]);
            crc.combine(&crc32fast::Hasher::new_with_initial_len(self.crc(file, number), records as u64));
            hashed = place.end;
        }
        crc.update(&file[hashed..offset]);
        let calculated = crc.finalize();
        if saved == calculated {
            return Ok(());
        }
        let what = format!("the data section's CRC is {saved:08x}, but its bytes give {calculated:08x}");
        Err(Damage::at(offset, what))
    }

    /// Reads a message of a chunk; the chunk's checksum is the caller's business.
    pub fn message<'a>(&self, file: &'a [u8], chunk: usize, entry: Entry) -> Result<Message<'a>, Damage> {
        let Entry { offset, kind, number } = entry;
        let record = record_at(file, offset as usize, self.chunks[chunk].end)?;
        let message = MessageRecord::parse(record)?;
        if message.sequence != number as u32 {
            let got = message.sequence;
            let what = format!("{kind} message {got}, where {kind} message {number} was expected");
            return Err(Damage::at(offset as usize, what));
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
