//! Damage in a recording: its place and its kind.

use std::fmt;

use mcap::records::op;

/// A damaged part of a recording.
#[derive(Debug, thiserror::Error)]
#[error("{part} at byte {offset}: {fault}")]
pub struct Damage {
    pub part: FilePart,
    /// Position of the part's first byte.
    pub offset: usize,
    pub fault: Fault,
}

impl Damage {
    /// Returns `true` if not even the first bytes are those of an MCAP file.
    pub fn is_of_another_format(&self) -> bool {
        self.part == FilePart::Magic && self.offset == 0
    }
}

/// A part of the file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilePart {
    /// The first eight bytes, or the last.
    Magic,
    /// Everything up to the summary.
    DataSection,
    Summary,
    /// A chunk, numbered from 1.
    Chunk(usize),
    /// A record, by its opcode.
    Record(u8),
}

/// The kind of damage.
#[derive(Debug, thiserror::Error)]
pub enum Fault {
    #[error("the file ends within it")]
    Cut,
    #[error("the file ends before it")]
    Missing,
    #[error("its checksum is {saved:08x}, and that of its bytes is {calculated:08x}")]
    Checksum { saved: u32, calculated: u32 },
    #[error("it says that it has {said} bytes, and it has {has}")]
    Length { said: u64, has: usize },
    #[error("it says that {compressed} bytes hold {uncompressed}, which is more than they can")]
    Expansion { compressed: usize, uncompressed: u64 },
    #[error("it says that it holds {has} bytes, and {most} are the most that are read")]
    TooMuch { has: u64, most: u64 },
    #[error("it is compressed as {0:?}; recordings are compressed as \"zstd\", and were as \"lz4\"")]
    Compression(String),
    #[error("it cannot be decompressed: {0}")]
    Decompress(std::io::Error),
    #[error("it cannot be read: {0}")]
    Content(mcap::McapError),
    #[error("it is not what has to be there")]
    Unexpected,
    #[error("message {found} of channel {channel} is where message {expected} has to be")]
    Sequence { channel: u16, expected: u32, found: u32 },
}

impl Fault {
    /// Returns the damage of `part`, which begins at `offset`, by this fault.
    pub fn of(self, part: FilePart, offset: usize) -> Damage {
        Damage { part, offset, fault: self }
    }
}

impl fmt::Display for FilePart {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let name = match *self {
            FilePart::Magic => "the mark of MCAP files",
            FilePart::DataSection => "the data section",
            FilePart::Summary => "the summary",
            FilePart::Chunk(number) => return write!(f, "chunk {number}"),
            FilePart::Record(op::HEADER) => "the header",
            FilePart::Record(op::FOOTER) => "the footer",
            FilePart::Record(op::DATA_END) => "the end of the data",
            FilePart::Record(op::MESSAGE_INDEX) => "a message index",
            FilePart::Record(op::ATTACHMENT) => "an attachment",
            FilePart::Record(op::METADATA) => "a metadata record",
            FilePart::Record(opcode) => return write!(f, "a record of kind {opcode:#04x}"),
        };
        f.write_str(name)
    }
}
