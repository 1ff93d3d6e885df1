//! Writing the container: MCAP records gathered into chunks, every byte fixed by what is put in.
//!
//! The one thing to know: the chunk in progress can be put on the sink before it is closed, any number of times
//! ([`ContainerWriter::flush`]). Its records go first and its head, which counts them and has their checksum, after
//! them, so at every moment the sink holds whole chunks and at most a tail that no head counts. The bytes of the closed
//! chunk are the same, however often it was flushed on the way.

use crate::container::{MAGIC, RECORD_HEAD_BYTES, op};
use std::collections::BTreeMap;
use std::io::{self, Write};

/// What a container is written to: bytes in sequence, and the head of the last chunk once more when the chunk has grown.
pub trait Sink: Write {
    /// Writes over bytes that were written before; what is written next still goes to the end.
    ///
    /// # Errors
    ///
    /// The system's, for instance on a pipe.
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()>;
}

impl Sink for Vec<u8> {
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        let start = offset as usize;
        self[start..start + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

impl Sink for std::fs::File {
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        std::os::unix::fs::FileExt::write_all_at(self, bytes, offset)
    }
}

impl<S: Sink + ?Sized> Sink for &mut S {
    fn rewrite(&mut self, offset: u64, bytes: &[u8]) -> io::Result<()> {
        (**self).rewrite(offset, bytes)
    }
}

/// Bytes of a chunk record before its records: record head, times, size, CRC, no compression, length.
pub(crate) const CHUNK_HEAD_BYTES: usize = RECORD_HEAD_BYTES + 8 + 8 + 8 + 4 + 4 + 8;

/// First and last log time of some messages (ns).
type Times = Option<(u64, u64)>;

/// Writes one container.
pub(crate) struct ContainerWriter<W: Sink> {
    sink: W,
    /// Bytes before the chunk in progress.
    position: u64,
    /// CRC-32 of them.
    crc: crc32fast::Hasher,
    /// Size of its records at which a chunk is closed before the next message.
    chunk_bytes: usize,
    chunk: OpenChunk,
    times_ns: Times,
    message_counts: BTreeMap<u16, u64>,
    /// Records of the summary section.
    schemas: Vec<u8>,
    schema_count: u16,
    channels: Vec<u8>,
    channel_count: u16,
    chunk_indexes: Vec<u8>,
    chunk_count: u32,
}

/// The chunk in progress.
#[derive(Default)]
struct OpenChunk {
    /// Room for its head, then its records; empty between chunks.
    bytes: Vec<u8>,
    /// How many of the bytes are on the sink.
    flushed: usize,
    /// CRC-32 of the records, as far as they have been hashed.
    crc: crc32fast::Hasher,
    hashed: usize,
    times_ns: Times,
    /// Log time and place of each message, by channel.
    places: BTreeMap<u16, Vec<(u64, u64)>>,
}

impl OpenChunk {
    fn is_open(&self) -> bool {
        !self.bytes.is_empty()
    }

    /// The buffer for records, with room for the head before them.
    fn records(&mut self) -> &mut Vec<u8> {
        if !self.is_open() {
            self.bytes.resize(CHUNK_HEAD_BYTES, 0);
            self.hashed = CHUNK_HEAD_BYTES;
        }
        &mut self.bytes
    }

    fn record_bytes(&self) -> usize {
        self.bytes.len().saturating_sub(CHUNK_HEAD_BYTES)
    }

    /// The head for the records that there are.
    fn head(&mut self) -> Vec<u8> {
        self.crc.update(&self.bytes[self.hashed..]);
        self.hashed = self.bytes.len();
        let length = self.record_bytes() as u64;
        let (first_ns, last_ns) = self.times_ns.unwrap_or_default();
        let mut head = Vec::with_capacity(CHUNK_HEAD_BYTES);
        head.push(op::CHUNK);
        head.extend((length + (CHUNK_HEAD_BYTES - RECORD_HEAD_BYTES) as u64).to_le_bytes());
        head.extend([first_ns, last_ns, length].map(u64::to_le_bytes).as_flattened());
        head.extend(self.crc.clone().finalize().to_le_bytes());
        head.extend(0_u32.to_le_bytes());
        head.extend(length.to_le_bytes());
        debug_assert_eq!(head.len(), CHUNK_HEAD_BYTES);
        head
    }
}

impl<W: Sink> ContainerWriter<W> {
    /// Begins a container; chunks are closed when their records exceed `chunk_bytes`, or by [`Self::close_chunk`].
    pub fn create(sink: W, library: &str, chunk_bytes: usize) -> io::Result<ContainerWriter<W>> {
        let mut writer = ContainerWriter {
            sink,
            position: 0,
            crc: crc32fast::Hasher::new(),
            chunk_bytes,
            chunk: OpenChunk::default(),
            times_ns: None,
            message_counts: BTreeMap::new(),
            schemas: Vec::new(),
            schema_count: 0,
            channels: Vec::new(),
            channel_count: 0,
            chunk_indexes: Vec::new(),
            chunk_count: 0,
        };
        let mut start = MAGIC.to_vec();
        put_record(&mut start, op::HEADER, |body| {
            put_text(body, "");
            put_text(body, library);
        });
        writer.put(&start)?;
        Ok(writer)
    }

    /// Adds a schema and returns its number, from 1.
    pub fn add_schema(&mut self, name: &str, encoding: &str, data: &[u8]) -> u16 {
        self.schema_count += 1;
        let (id, begin) = (self.schema_count, self.schemas.len());
        put_record(&mut self.schemas, op::SCHEMA, |body| {
            body.extend(id.to_le_bytes());
            put_text(body, name);
            put_text(body, encoding);
            put_part(body, data);
        });
        self.chunk.records().extend_from_slice(&self.schemas[begin..]);
        id
    }

    /// Adds a channel and returns its number, from 1; schema 0 is none.
    pub fn add_channel(
        &mut self,
        schema_id: u16,
        topic: &str,
        message_encoding: &str,
        metadata: &BTreeMap<String, String>,
    ) -> u16 {
        self.channel_count += 1;
        let (id, begin) = (self.channel_count, self.channels.len());
        let mut pairs = Vec::new();
        for (key, value) in metadata {
            put_text(&mut pairs, key);
            put_text(&mut pairs, value);
        }
        put_record(&mut self.channels, op::CHANNEL, |body| {
            body.extend(id.to_le_bytes());
            body.extend(schema_id.to_le_bytes());
            put_text(body, topic);
            put_text(body, message_encoding);
            put_part(body, &pairs);
        });
        self.chunk.records().extend_from_slice(&self.channels[begin..]);
        id
    }

    /// Appends a message. A chunk that is large enough is closed before.
    pub fn write(&mut self, channel_id: u16, sequence: u32, log_time_ns: u64, data: &[u8]) -> io::Result<()> {
        if self.chunk.record_bytes() > self.chunk_bytes {
            self.close_chunk()?;
        }
        stretch(&mut self.times_ns, log_time_ns);
        *self.message_counts.entry(channel_id).or_default() += 1;
        stretch(&mut self.chunk.times_ns, log_time_ns);
        let place = self.chunk.record_bytes() as u64;
        self.chunk.places.entry(channel_id).or_default().push((log_time_ns, place));
        let records = self.chunk.records();
        records.push(op::MESSAGE);
        records.extend((2 + 4 + 8 + 8 + data.len() as u64).to_le_bytes());
        records.extend(channel_id.to_le_bytes());
        records.extend(sequence.to_le_bytes());
        // Log time and publish time.
        records.extend([log_time_ns, log_time_ns].map(u64::to_le_bytes).as_flattened());
        records.extend_from_slice(data);
        Ok(())
    }

    /// Whether the chunk in progress is one of the first `count`, or holds at least one part in `count` of the container
    /// so far.
    pub fn is_chunk_worth_closing(&self, count: u32) -> bool {
        self.chunk_count < count || self.chunk.bytes.len() as u64 >= self.position / u64::from(count)
    }

    /// Bytes of the container so far, those of the chunk in progress included.
    pub fn bytes(&self) -> u64 {
        self.position + self.chunk.bytes.len() as u64
    }

    /// Closes the chunk in progress, if there is one, and writes its message indexes.
    pub fn close_chunk(&mut self) -> io::Result<()> {
        if !self.chunk.is_open() {
            return Ok(());
        }
        let head = self.chunk.head();
        let record_bytes = self.chunk.record_bytes() as u64;
        let chunk_offset = self.position;
        let indexes_begin = self.chunk.bytes.len();
        let mut index_offsets = Vec::new();
        for (channel_id, places) in std::mem::take(&mut self.chunk.places) {
            index_offsets.extend(channel_id.to_le_bytes());
            index_offsets.extend((chunk_offset + self.chunk.bytes.len() as u64).to_le_bytes());
            put_record(&mut self.chunk.bytes, op::MESSAGE_INDEX, |body| {
                body.extend(channel_id.to_le_bytes());
                body.extend((16 * places.len() as u32).to_le_bytes());
                for (log_time_ns, place) in places {
                    body.extend([log_time_ns, place].map(u64::to_le_bytes).as_flattened());
                }
            });
        }
        let (indexes_bytes, all_bytes) =
            ((self.chunk.bytes.len() - indexes_begin) as u64, self.chunk.bytes.len() as u64);
        self.put_chunk(&head)?;
        let OpenChunk { mut bytes, crc, times_ns, .. } = std::mem::take(&mut self.chunk);
        self.crc.update(&head);
        self.crc.combine(&crc);
        self.crc.update(&bytes[indexes_begin..]);
        self.position += all_bytes;
        // The buffer is used again.
        bytes.clear();
        self.chunk.bytes = bytes;
        let (first_ns, last_ns) = times_ns.unwrap_or_default();
        self.chunk_count += 1;
        put_record(&mut self.chunk_indexes, op::CHUNK_INDEX, |body| {
            let places = [first_ns, last_ns, chunk_offset, CHUNK_HEAD_BYTES as u64 + record_bytes];
            body.extend(places.map(u64::to_le_bytes).as_flattened());
            put_part(body, &index_offsets);
            body.extend(indexes_bytes.to_le_bytes());
            put_text(body, "");
            body.extend([record_bytes, record_bytes].map(u64::to_le_bytes).as_flattened());
        });
        Ok(())
    }

    /// Puts the chunk in progress on the sink as it is now, without closing it.
    pub fn flush(&mut self) -> io::Result<()> {
        if self.chunk.is_open() && self.chunk.flushed < self.chunk.bytes.len() {
            let head = self.chunk.head();
            self.put_chunk(&head)?;
        }
        self.sink.flush()
    }

    /// Brings the sink up to date with the chunk's bytes, its head last.
    fn put_chunk(&mut self, head: &[u8]) -> io::Result<()> {
        self.chunk.bytes[..CHUNK_HEAD_BYTES].copy_from_slice(head);
        let is_begun = self.chunk.flushed > 0;
        self.sink.write_all(&self.chunk.bytes[self.chunk.flushed..])?;
        if is_begun {
            self.sink.rewrite(self.position, head)?;
        }
        self.chunk.flushed = self.chunk.bytes.len();
        Ok(())
    }

    /// Closes the last chunk, writes the summary section, and returns the sink and the size of the file.
    pub fn finish(mut self) -> io::Result<(W, u64)> {
        self.close_chunk()?;
        let mut tail = Vec::new();
        let data_crc = self.crc.clone().finalize();
        put_record(&mut tail, op::DATA_END, |body| body.extend(data_crc.to_le_bytes()));
        let summary_begin = tail.len();
        let statistics = self.statistics();
        let mut offsets = Vec::new();
        for (opcode, group) in [
            (op::SCHEMA, &self.schemas),
            (op::CHANNEL, &self.channels),
            (op::STATISTICS, &statistics),
            (op::CHUNK_INDEX, &self.chunk_indexes),
        ] {
            if !group.is_empty() {
                let place = [self.position + tail.len() as u64, group.len() as u64];
                put_record(&mut offsets, op::SUMMARY_OFFSET, |body| {
                    body.push(opcode);
                    body.extend(place.map(u64::to_le_bytes).as_flattened());
                });
                tail.extend_from_slice(group);
            }
        }
        let offsets_begin = self.position + tail.len() as u64;
        tail.extend(offsets);
        put_record(&mut tail, op::FOOTER, |body| {
            let summary = self.position + summary_begin as u64;
            body.extend([summary, offsets_begin].map(u64::to_le_bytes).as_flattened());
            body.extend([0; 4]);
        });
        let checked_end = tail.len() - 4;
        let summary_crc = crc32fast::hash(&tail[summary_begin..checked_end]);
        tail[checked_end..].copy_from_slice(&summary_crc.to_le_bytes());
        tail.extend(MAGIC);
        self.sink.write_all(&tail)?;
        self.sink.flush()?;
        Ok((self.sink, self.position + tail.len() as u64))
    }

    fn statistics(&self) -> Vec<u8> {
        let (first_ns, last_ns) = self.times_ns.unwrap_or_default();
        let mut counts = Vec::new();
        for (channel_id, count) in &self.message_counts {
            counts.extend(channel_id.to_le_bytes());
            counts.extend(count.to_le_bytes());
        }
        let mut record = Vec::new();
        put_record(&mut record, op::STATISTICS, |body| {
            body.extend(self.message_counts.values().sum::<u64>().to_le_bytes());
            body.extend(self.schema_count.to_le_bytes());
            // Channels; attachments and metadata records, which a log has none of; chunks.
            for count in [u32::from(self.channel_count), 0, 0, self.chunk_count] {
                body.extend(count.to_le_bytes());
            }
            body.extend([first_ns, last_ns].map(u64::to_le_bytes).as_flattened());
            put_part(body, &counts);
        });
        record
    }

    /// Writes bytes that belong to no chunk.
    fn put(&mut self, bytes: &[u8]) -> io::Result<()> {
        self.sink.write_all(bytes)?;
        self.crc.update(bytes);
        self.position += bytes.len() as u64;
        Ok(())
    }
}

fn stretch(times: &mut Times, time_ns: u64) {
    let (first, last) = times.get_or_insert((time_ns, time_ns));
    if time_ns < *first {
        *first = time_ns;
    }
    if time_ns > *last {
        *last = time_ns;
    }
}

/// Appends a record: its opcode, its length, and the body that `fill` appends.
fn put_record(bytes: &mut Vec<u8>, opcode: u8, fill: impl FnOnce(&mut Vec<u8>)) {
    bytes.push(opcode);
    let length_at = bytes.len();
    bytes.extend([0; 8]);
    fill(bytes);
    let length = (bytes.len() - length_at - 8) as u64;
    bytes[length_at..length_at + 8].copy_from_slice(&length.to_le_bytes());
}

fn put_text(bytes: &mut Vec<u8>, text: &str) {
    put_part(bytes, text.as_bytes());
}

/// Appends a part with its length before it.
fn put_part(bytes: &mut Vec<u8>, part: &[u8]) {
    bytes.extend((part.len() as u32).to_le_bytes());
    bytes.extend_from_slice(part);
}
