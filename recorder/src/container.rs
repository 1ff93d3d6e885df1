//! The container: MCAP records in a byte slice, borrowed, with every length checked before it is believed.
//!
//! Reading is done here and not by the `mcap` crate because a log is compared and replayed from its mapped
//! bytes: no copy, the byte offset of any damage, no allocation on the word of a length field.

/// Opcodes of the records that a log has.
pub(crate) mod op {
    pub const HEADER: u8 = 0x01;
    pub const FOOTER: u8 = 0x02;
    pub const SCHEMA: u8 = 0x03;
    pub const CHANNEL: u8 = 0x04;
    pub const MESSAGE: u8 = 0x05;
    pub const CHUNK: u8 = 0x06;
    pub const MESSAGE_INDEX: u8 = 0x07;
    pub const CHUNK_INDEX: u8 = 0x08;
    pub const STATISTICS: u8 = 0x0B;
    pub const SUMMARY_OFFSET: u8 = 0x0E;
    pub const DATA_END: u8 = 0x0F;
}

/// The first and the last eight bytes of an MCAP file.
pub(crate) const MAGIC: [u8; 8] = *b"\x89MCAP0\r\n";
/// Opcode and length before a record's body.
pub(crate) const RECORD_HEAD_BYTES: usize = 9;
/// The whole footer record and the magic after it.
pub(crate) const FOOTER_BYTES: usize = RECORD_HEAD_BYTES + 20 + MAGIC.len();

/// A place where the bytes are not what a container holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Damage {
    /// Byte offset in the file.
    pub offset: u64,
    /// What is there and what was expected.
    pub what: String,
    /// Whether the file merely ends too early.
    pub cut: bool,
}

impl Damage {
    pub fn at(offset: usize, what: impl Into<String>) -> Damage {
        Damage { offset: offset as u64, what: what.into(), cut: false }
    }
}

/// One record: opcode and body.
#[derive(Clone, Copy)]
pub(crate) struct Record<'a> {
    pub opcode: u8,
    pub body: Fields<'a>,
    /// Offset of the byte after it.
    pub end: usize,
}

/// The record that begins at an offset of the file and ends before `limit`.
pub(crate) fn record_at(file: &[u8], offset: usize, limit: usize) -> Result<Record<'_>, Damage> {
    let cut = |what: String| Damage { cut: limit == file.len(), ..Damage::at(offset, what) };
    let room = limit.min(file.len()).saturating_sub(offset);
    if room < RECORD_HEAD_BYTES {
        return Err(cut(format!("a record begins, but only {room} bytes are left")));
    }
    let mut head = Fields::new(file, offset, offset + RECORD_HEAD_BYTES);
    let (opcode, length) = (head.u8()?, head.u64()?);
    let body_room = room - RECORD_HEAD_BYTES;
    if length > body_room as u64 {
        let what =
            format!("a record (opcode {opcode:#04x}) of {length} bytes, but only {body_room} are left");
        return Err(cut(what));
    }
    let start = offset + RECORD_HEAD_BYTES;
    let end = start + length as usize;
    Ok(Record { opcode, body: Fields::new(file, start, end), end })
}

/// Reads little-endian fields one after the other, within bounds.
#[derive(Clone, Copy)]
pub(crate) struct Fields<'a> {
    file: &'a [u8],
    position: usize,
    end: usize,
}

impl<'a> Fields<'a> {
    pub fn new(file: &'a [u8], start: usize, end: usize) -> Fields<'a> {
        Fields { file, position: start, end: end.min(file.len()) }
    }

    /// Offset in the file of what is read next.
    pub fn position(&self) -> usize {
        self.position
    }

    pub fn is_empty(&self) -> bool {
        self.position >= self.end
    }

    /// Takes a number of bytes.
    pub fn take(&mut self, length: u64) -> Result<&'a [u8], Damage> {
        let room = self.end.saturating_sub(self.position);
        if length > room as u64 {
            let what = format!("a field of {length} bytes, but its record has only {room} left");
            return Err(Damage::at(self.position, what));
        }
        let start = self.position;
        self.position += length as usize;
        Ok(&self.file[start..self.position])
    }

    /// Takes the rest.
    pub fn rest(&mut self) -> &'a [u8] {
        let start = self.position.min(self.end);
        self.position = self.end;
        &self.file[start..self.end]
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Damage> {
        let mut array = [0; N];
        array.copy_from_slice(self.take(N as u64)?);
        Ok(array)
    }

    pub fn u8(&mut self) -> Result<u8, Damage> {
        Ok(self.array::<1>()?[0])
    }

    pub fn u16(&mut self) -> Result<u16, Damage> {
        Ok(u16::from_le_bytes(self.array()?))
    }

    pub fn u32(&mut self) -> Result<u32, Damage> {
        Ok(u32::from_le_bytes(self.array()?))
    }

    pub fn u64(&mut self) -> Result<u64, Damage> {
        Ok(u64::from_le_bytes(self.array()?))
    }

    /// A text with its length before it.
    pub fn text(&mut self) -> Result<&'a str, Damage> {
        let length = self.u32()?;
        let offset = self.position;
        let bytes = self.take(u64::from(length))?;
        std::str::from_utf8(bytes).map_err(|error| Damage::at(offset, format!("a text: {error}")))
    }

    /// A part with its length in bytes before it.
    pub fn part(&mut self) -> Result<Fields<'a>, Damage> {
        let length = self.u32()?;
        let start = self.position;
        self.take(u64::from(length))?;
        Ok(Fields::new(self.file, start, self.position))
    }
}

/// A chunk: where its records lie, and their checksum.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Chunk {
    /// Offset of the chunk record.
    pub offset: usize,
    /// Offset of the first record in it.
    pub start: usize,
    /// Offset of the byte after the last record in it.
    pub end: usize,
    /// CRC-32 of the records.
    pub crc: u32,
}

impl Chunk {
    /// Reads a chunk record's head. A compressed chunk is refused: see [`Chunk::COMPRESSED`].
    pub fn parse(record: Record, offset: usize) -> Result<Chunk, Damage> {
        let mut body = record.body;
        let _times_ns = (body.u64()?, body.u64()?);
        let uncompressed_bytes = body.u64()?;
        let crc = body.u32()?;
        let compression = body.text()?;
        if !compression.is_empty() {
            return Err(Damage::at(offset, format!("{}: \"{compression}\"", Chunk::COMPRESSED)));
        }
        let bytes = body.u64()?;
        let start = body.position();
        if bytes != uncompressed_bytes || body.rest().len() as u64 != bytes {
            let what = format!("a chunk of {bytes} bytes that claims {uncompressed_bytes} uncompressed");
            return Err(Damage::at(offset, what));
        }
        Ok(Chunk { offset, start, end: record.end, crc })
    }

    /// What is said about a compressed chunk.
    pub const COMPRESSED: &'static str =
        "a compressed chunk (logs are written uncompressed; decompress it with an MCAP tool first)";

    /// Checks the checksum of its records.
    pub fn check(&self, file: &[u8]) -> Result<(), Damage> {
        let calculated = crc32fast::hash(&file[self.start..self.end]);
        if calculated == self.crc {
            return Ok(());
        }
        let what = format!("the chunk's CRC is {:08x}, but its bytes give {calculated:08x}", self.crc);
        Err(Damage::at(self.offset, what))
    }
}

/// A message record, taken apart.
pub(crate) struct MessageRecord<'a> {
    pub channel_id: u16,
    pub sequence: u32,
    pub log_time_ns: u64,
    pub bytes: &'a [u8],
}

impl<'a> MessageRecord<'a> {
    pub fn parse(record: Record<'a>) -> Result<MessageRecord<'a>, Damage> {
        let mut body = record.body;
        let (channel_id, sequence, log_time_ns) = (body.u16()?, body.u32()?, body.u64()?);
        let _publish_time_ns = body.u64()?;
        Ok(MessageRecord { channel_id, sequence, log_time_ns, bytes: body.rest() })
    }
}

/// A channel record, as far as a log needs it.
pub(crate) struct ChannelRecord<'a> {
    pub id: u16,
    pub topic: &'a str,
    /// Value of `layout_hash` in the metadata.
    pub layout_hash: Option<&'a str>,
}

impl<'a> ChannelRecord<'a> {
    pub fn parse(record: Record<'a>) -> Result<ChannelRecord<'a>, Damage> {
        let mut body = record.body;
        let (id, _schema_id) = (body.u16()?, body.u16()?);
        let (topic, _message_encoding) = (body.text()?, body.text()?);
        let mut metadata = body.part()?;
        let mut layout_hash = None;
        while !metadata.is_empty() {
            let (key, value) = (metadata.text()?, metadata.text()?);
            if key == "layout_hash" {
                layout_hash = Some(value);
            }
        }
        Ok(ChannelRecord { id, topic, layout_hash })
    }
}

/// The number of messages of each channel, from a statistics record.
pub(crate) fn message_counts(record: Record) -> Result<Vec<(u16, u64)>, Damage> {
    let mut body = record.body;
    // Message, schema, channel, attachment, metadata and chunk counts; first and last time.
    body.take(8 + 2 + 4 + 4 + 4 + 4 + 8 + 8)?;
    let mut counts = body.part()?;
    let mut of_channels = Vec::new();
    while !counts.is_empty() {
        of_channels.push((counts.u16()?, counts.u64()?));
    }
    Ok(of_channels)
}
