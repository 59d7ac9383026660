//! Reading of a recording's data section, record by record. Each record is checked before use: a length
//! must fit in the file, decompression is bounded, and checksums are compared where there are any.
//!
//! The library that writes recordings can also read them: its `sans_io::LinearReader` limits the length of
//! records and checks checksums. It takes a checksum of 0 for a missing one, even in files by Tandem, which
//! always writes one. It reports neither the position of damage nor the positions of the bytes of chunks
//! and attachments, which are opened later. Here it could replace only `frame` and `take_record`, at the
//! price of another copy of the file.

use std::collections::{BTreeMap, HashMap};
use std::io::{self, Read};
use std::ops::Range;

use mcap::MAGIC;
use mcap::records::{Metadata, Record, op};

use super::damage::{Damage, Fault, FilePart};
use super::metadata;

/// Upper limit of the expansion factor of LZ4's format.
const LZ4_MOST_EXPANSION: u64 = 255;
/// Upper limit of the expansion factor of Zstandard's format: a block of at most 128 KiB can be encoded as a
/// header of three bytes and one byte to repeat.
const ZSTD_MOST_EXPANSION: u64 = (128 << 10) / 4;

/// Maximum size of a decompressed chunk. Tandem's chunks have 256 KiB and one message more.
const MAX_CHUNK_BYTES: u64 = 256 << 20;
/// Maximum size of all chunks together, decompressed.
const MAX_RECORDS_BYTES: u64 = 16 << 30;

/// Prefix of the library name in the header of every recording by Tandem, followed by a version. These
/// recordings have all checksums.
pub const LIBRARY: &str = "tandem ";

/// Length of an opcode and a length field.
const FRAME_BYTES: usize = 1 + size_of::<u64>();

/// The data of a recording, from its first byte to the end of the data.
pub struct DataSection<'a> {
    bytes: &'a [u8],
    position: usize,
    /// True if Tandem wrote the file.
    own: bool,
    chunks: usize,
    /// Bytes of all chunks up to the present position, decompressed.
    records_bytes: u64,
    /// Expected sequence number of the next message of each channel.
    sequences: HashMap<u16, u32>,
    /// Expected content of the message indexes after the last chunk: time and offset of each message, by
    /// channel.
    indexes: BTreeMap<u16, Vec<(u64, u64)>>,
    /// Checksum at the end of the data; `None` until it has been read.
    saved_checksum: Option<u32>,
    pub without_checksum: WithoutChecksum,
}

/// Number of parts without a separate checksum.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct WithoutChecksum {
    pub chunks: usize,
    pub attachments: usize,
    pub metadata: usize,
}

/// A part of the data that is read back.
pub enum DataPart {
    Chunk(ChunkPlace, ChunkRecords),
    Attachment(AttachmentPlace),
    Metadata(Metadata),
}

/// Position of a chunk.
#[derive(Clone, Debug)]
pub struct ChunkPlace {
    number: usize,
    offset: usize,
    content: Range<usize>,
}

/// An attachment, and the position of its bytes.
#[derive(Clone, Debug)]
pub struct AttachmentPlace {
    pub log_time: u64,
    pub create_time: u64,
    pub name: String,
    pub media_type: String,
    pub data: Range<usize>,
}

impl<'a> DataSection<'a> {
    /// Begins at the first byte of a file.
    pub fn begin(bytes: &'a [u8]) -> Result<DataSection<'a>, Damage> {
        if !bytes.starts_with(MAGIC) {
            return Err(Fault::Unexpected.of(FilePart::Magic, 0));
        }
        let mut data = DataSection {
            bytes,
            position: MAGIC.len(),
            own: false,
            chunks: 0,
            records_bytes: 0,
            sequences: HashMap::new(),
            indexes: BTreeMap::new(),
            saved_checksum: None,
            without_checksum: WithoutChecksum::default(),
        };
        let header = FilePart::Record(op::HEADER);
        let found = match data.take_record()? {
            Some((op::HEADER, content)) => read_header(&bytes[content]),
            Some(_) => Err(Fault::Unexpected),
            None => Err(Fault::Missing),
        };
        let library = found.map_err(|fault| fault.of(header, MAGIC.len()))?;
        data.own = library.starts_with(LIBRARY);
        Ok(data)
    }

    /// Returns the next part, checked against its own checksum if it has one. Returns `None` at the end of
    /// the data or of the file.
    pub fn next_part(&mut self) -> Result<Option<DataPart>, Damage> {
        while self.saved_checksum.is_none() {
            let offset = self.position;
            let Some((opcode, content)) = self.take_record()? else { return Ok(None) };
            let part = self.part(opcode);
            if let Some(read) = self.read(opcode, offset, content).map_err(|fault| fault.of(part, offset))? {
                return Ok(Some(read));
            }
        }
        Ok(None)
    }

    /// Checks the data up to the present position, which must be the end of the data. Returns `true` if a
    /// checksum covers them.
    pub fn check_end(&self) -> Result<bool, Damage> {
        let saved = self
            .saved_checksum
            .ok_or_else(|| Fault::Missing.of(FilePart::Record(op::DATA_END), self.position))?;
        let data = &self.bytes[..self.position - FRAME_BYTES - size_of::<u32>()];
        self.is_covered(saved, data).map_err(|fault| fault.of(FilePart::DataSection, 0))
    }

    /// Returns `true` if Tandem wrote the file.
    pub fn is_own(&self) -> bool {
        self.own
    }

    /// Returns the position that has been reached.
    pub fn position(&self) -> usize {
        self.position
    }

    /// Returns the opcode and the content of the next record; `None` at the end of the file.
    fn take_record(&mut self) -> Result<Option<(u8, Range<usize>)>, Damage> {
        let offset = self.position;
        let Some(opcode) = self.bytes.get(offset) else { return Ok(None) };
        let content = frame(self.bytes, offset).ok_or_else(|| Fault::Cut.of(self.part(*opcode), offset))?;
        self.position = content.end;
        Ok(Some((*opcode, content)))
    }

    /// Returns the kind of the next record.
    fn part(&self, opcode: u8) -> FilePart {
        match opcode {
            op::CHUNK => FilePart::Chunk(self.chunks + 1),
            opcode => FilePart::Record(opcode),
        }
    }

    fn read(&mut self, opcode: u8, offset: usize, content: Range<usize>) -> Result<Option<DataPart>, Fault> {
        let bytes = &self.bytes[content.clone()];
        match opcode {
            op::CHUNK => {
                let place = ChunkPlace { number: self.chunks + 1, offset, content };
                let records = self.read_chunk(bytes)?;
                self.chunks += 1;
                Ok(Some(DataPart::Chunk(place, records)))
            }
            op::ATTACHMENT => self.read_attachment(content).map(|place| Some(DataPart::Attachment(place))),
            op::METADATA => {
                let Record::Metadata(found) = parse(op::METADATA, bytes)? else {
                    return Err(Fault::Unexpected);
                };
                let entries = found.metadata.iter().map(|(key, value)| text_bytes(key) + text_bytes(value));
                expect_length(bytes, text_bytes(&found.name) + size_of::<u32>() + entries.sum::<usize>())?;
                if !metadata::is_covered(&found)? {
                    self.without_checksum.metadata += 1;
                }
                Ok(Some(DataPart::Metadata(found)))
            }
            op::MESSAGE_INDEX => self.compare_index(bytes).map(|()| None),
            op::DATA_END => {
                let saved = bytes.try_into().map_err(|_| Fault::Length { said: 4, has: bytes.len() })?;
                self.saved_checksum = Some(u32::from_le_bytes(saved));
                Ok(None)
            }
            // All other records are within chunks, or after the data.
            _ => Err(Fault::Unexpected),
        }
    }

    /// Decompresses a chunk, and checks the sequence numbers of its messages: none may be missing.
    fn read_chunk(&mut self, content: &[u8]) -> Result<ChunkRecords, Fault> {
        let (saved, records) = decompress(content)?;
        if !self.is_covered(saved, &records.bytes)? {
            self.without_checksum.chunks += 1;
        }
        self.records_bytes += records.bytes.len() as u64;
        if self.records_bytes > MAX_RECORDS_BYTES {
            return Err(Fault::TooMuch { has: self.records_bytes, most: MAX_RECORDS_BYTES });
        }
        self.indexes.clear();
        for record in records.iter() {
            let (offset, record) = record?;
            match record {
                Record::Message { header, .. } => {
                    let entry = (header.log_time, offset as u64);
                    self.indexes.entry(header.channel_id).or_default().push(entry);
                    let next = self.sequences.entry(header.channel_id).or_default();
                    let (channel, expected, found) = (header.channel_id, *next, header.sequence);
                    if self.own && found != expected {
                        return Err(Fault::Sequence { channel, expected, found });
                    }
                    *next = found.wrapping_add(1);
                }
                Record::Schema { .. } | Record::Channel(_) => {}
                _ => return Err(Fault::Unexpected),
            }
        }
        Ok(records)
    }

    fn read_attachment(&mut self, content: Range<usize>) -> Result<AttachmentPlace, Fault> {
        let bytes = &self.bytes[content.clone()];
        let mut fields = Fields { bytes, position: 0 };
        let (log_time, create_time) = (fields.u64()?, fields.u64()?);
        let (name, media_type) = (fields.text()?, fields.text()?);
        let length = fields.u64()?;
        let start = fields.position;
        fields.take(length)?;
        let end = fields.position;
        let saved = fields.u32()?;
        expect_length(bytes, fields.position)?;
        if !self.is_covered(saved, &bytes[..end])? {
            self.without_checksum.attachments += 1;
        }
        let data = content.start + start..content.start + end;
        Ok(AttachmentPlace { log_time, create_time, name, media_type, data })
    }

    /// Compares a message index with the chunk before it. An index has no further information.
    fn compare_index(&mut self, content: &[u8]) -> Result<(), Fault> {
        let Record::MessageIndex(index) = parse(op::MESSAGE_INDEX, content)? else {
            return Err(Fault::Unexpected);
        };
        let entries = index.records.len() * 2 * size_of::<u64>();
        expect_length(content, size_of::<u16>() + size_of::<u32>() + entries)?;
        let mut entries: Vec<_> = index.records.iter().map(|entry| (entry.log_time, entry.offset)).collect();
        let mut expected = self.indexes.remove(&index.channel_id).unwrap_or_default();
        entries.sort_unstable();
        expected.sort_unstable();
        if entries == expected { Ok(()) } else { Err(Fault::Unexpected) }
    }

    fn is_covered(&self, saved: u32, bytes: &[u8]) -> Result<bool, Fault> {
        is_covered(saved, bytes, self.own)
    }
}

/// Checks `bytes` against a saved checksum. Returns `false` if there is none: programs other than Tandem may
/// leave it out, which is written as 0.
pub fn is_covered(saved: u32, bytes: &[u8], own: bool) -> Result<bool, Fault> {
    match crc32fast::hash(bytes) {
        calculated if calculated == saved => Ok(true),
        _ if saved == 0 && !own => Ok(false),
        calculated => Err(Fault::Checksum { saved, calculated }),
    }
}

/// Returns the range of the content of the record at `offset`; `None` if `bytes` end within it.
fn frame(bytes: &[u8], offset: usize) -> Option<Range<usize>> {
    let start = offset.checked_add(FRAME_BYTES)?;
    let length = bytes.get(offset + 1..start)?;
    let length = usize::try_from(u64::from_le_bytes(length.try_into().ok()?)).ok()?;
    let end = start.checked_add(length)?;
    (end <= bytes.len()).then_some(start..end)
}

/// Returns the library name of a header.
fn read_header(content: &[u8]) -> Result<String, Fault> {
    let Record::Header(header) = parse(op::HEADER, content)? else { return Err(Fault::Unexpected) };
    expect_length(content, text_bytes(&header.profile) + text_bytes(&header.library))?;
    Ok(header.library)
}

/// Returns the length of a text together with the length field before it.
fn text_bytes(text: &str) -> usize {
    size_of::<u32>() + text.len()
}

/// Checks that the fields of a record fill it exactly.
fn expect_length(content: &[u8], fields: usize) -> Result<(), Fault> {
    match content.len() {
        has if has == fields => Ok(()),
        has => Err(Fault::Length { said: fields as u64, has }),
    }
}

/// Parses a record with the library's parser, which checks its lengths.
fn parse(opcode: u8, content: &[u8]) -> Result<Record<'_>, Fault> {
    mcap::parse_record(opcode, content).map_err(Fault::Content)
}

/// The decompressed content of a chunk.
pub struct ChunkRecords {
    bytes: Vec<u8>,
}

impl ChunkRecords {
    /// Iterates over schemas, channels and messages, each with its offset.
    pub fn iter(&self) -> impl Iterator<Item = Result<(usize, Record<'_>), Fault>> {
        let mut position = 0;
        std::iter::from_fn(move || {
            let offset = position;
            let opcode = *self.bytes.get(offset)?;
            // If a record cannot be framed, the records after it cannot be framed either.
            position = self.bytes.len();
            let record = match (opcode, frame(&self.bytes, offset)) {
                (op::SCHEMA | op::CHANNEL | op::MESSAGE, Some(content)) => {
                    position = content.end;
                    parse(opcode, &self.bytes[content])
                }
                (_, Some(_)) => Err(Fault::Unexpected),
                (_, None) => Err(Fault::Cut),
            };
            Some(record.map(|record| (offset, record)))
        })
    }
}

impl ChunkPlace {
    /// Decompresses the checked chunk once more.
    pub fn open(&self, bytes: &[u8]) -> Result<ChunkRecords, Damage> {
        let opened = decompress(&bytes[self.content.clone()]);
        opened.map(|(_, records)| records).map_err(|fault| self.damaged(fault))
    }

    pub fn damaged(&self, fault: Fault) -> Damage {
        fault.of(FilePart::Chunk(self.number), self.offset)
    }
}

/// Returns the saved checksum of a chunk, and its content.
fn decompress(content: &[u8]) -> Result<(u32, ChunkRecords), Fault> {
    let Record::Chunk { header, data } = parse(op::CHUNK, content)? else { return Err(Fault::Unexpected) };
    let (compressed, uncompressed) = (data.len(), header.uncompressed_size);
    // The fixed fields: two times, two sizes and a checksum. The name of the compression and the data
    // follow.
    let fixed = 4 * size_of::<u64>() + size_of::<u32>();
    expect_length(content, fixed + text_bytes(&header.compression) + compressed)?;
    let bytes = match header.compression.as_str() {
        "" => data.into_owned(),
        "lz4" if uncompressed > compressed as u64 * LZ4_MOST_EXPANSION => {
            return Err(Fault::Expansion { compressed, uncompressed });
        }
        "zstd" if uncompressed > compressed as u64 * ZSTD_MOST_EXPANSION => {
            return Err(Fault::Expansion { compressed, uncompressed });
        }
        "lz4" | "zstd" if uncompressed > MAX_CHUNK_BYTES => {
            return Err(Fault::TooMuch { has: uncompressed, most: MAX_CHUNK_BYTES });
        }
        "lz4" => read_all(lz4::Decoder::new(&*data), uncompressed)?,
        "zstd" => read_all(zstd::Decoder::new(&*data), uncompressed)?,
        other => return Err(Fault::Compression(other.into())),
    };
    if bytes.len() as u64 != uncompressed {
        return Err(Fault::Length { said: uncompressed, has: bytes.len() });
    }
    Ok((header.uncompressed_crc, ChunkRecords { bytes }))
}

/// Reads a decoder's output, at most one byte more than expected: that byte is enough to detect an excess.
fn read_all(decoder: io::Result<impl Read>, expected: u64) -> Result<Vec<u8>, Fault> {
    let mut bytes = Vec::new();
    let decoder = decoder.map_err(Fault::Decompress)?;
    decoder.take(expected + 1).read_to_end(&mut bytes).map_err(Fault::Decompress)?;
    Ok(bytes)
}

/// Reader of a record's fields, one after the other.
struct Fields<'a> {
    bytes: &'a [u8],
    position: usize,
}

impl<'a> Fields<'a> {
    fn take(&mut self, length: u64) -> Result<&'a [u8], Fault> {
        let rest = &self.bytes[self.position..];
        let too_long = Fault::Length { said: length, has: rest.len() };
        let length = usize::try_from(length).ok().filter(|length| *length <= rest.len()).ok_or(too_long)?;
        self.position += length;
        Ok(&rest[..length])
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], Fault> {
        self.take(N as u64)?.try_into().map_err(|_| Fault::Unexpected)
    }

    fn u32(&mut self) -> Result<u32, Fault> {
        self.array().map(u32::from_le_bytes)
    }

    fn u64(&mut self) -> Result<u64, Fault> {
        self.array().map(u64::from_le_bytes)
    }

    fn text(&mut self) -> Result<String, Fault> {
        let length = self.u32()?;
        let bytes = self.take(length.into())?;
        String::from_utf8(bytes.into()).map_err(|_| Fault::Unexpected)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_chunk_is_not_decompressed_into_more_than_anybody_writes() {
        let data = [0; 16 << 10];
        let mut content = Vec::new();
        for field in [0, 0, MAX_CHUNK_BYTES + 1] {
            content.extend(u64::to_le_bytes(field));
        }
        content.extend(u32::to_le_bytes(0));
        content.extend(u32::to_le_bytes(4));
        content.extend(b"zstd");
        content.extend(u64::to_le_bytes(data.len() as u64));
        content.extend(data);
        let refused = decompress(&content).map(drop).unwrap_err();
        assert!(matches!(refused, Fault::TooMuch { most: MAX_CHUNK_BYTES, .. }), "{refused}");
    }
}
