//! A whole recording in memory with all checksums verified.
//!
//! | bytes | checked against |
//! |---|---|
//! | the marks at both ends, opcode and length of the footer | their fixed values |
//! | header, metadata, message indexes, lengths | the checksum of the data section, at the end of the data |
//! | chunks, attachments, metadata | the same, and first their own, which locates the damage |
//! | the summary, and the rest of the footer | the checksum in the footer |
//! | the checksums | the checksums calculated from the bytes that they cover |

use std::collections::{BTreeMap, BTreeSet};

use mcap::MAGIC;
use mcap::records::{Record, op};

use super::damage::{Damage, Fault, FilePart};
use super::data_section::{AttachmentPlace, ChunkPlace, DataPart, DataSection, WithoutChecksum, is_covered};

/// Length of a footer's content: the offsets of the summary and of its offset section, and their checksum.
const FOOTER_BYTES: usize = 2 * size_of::<u64>() + size_of::<u32>();
/// Opcode and length, with which a footer begins.
const FOOTER_RECORD: [u8; 9] = [op::FOOTER, FOOTER_BYTES as u8, 0, 0, 0, 0, 0, 0, 0];

/// Maximum size of one topic's messages. The requests and replies of a long episode take a tenth of that.
const MAX_TOPIC_BYTES: usize = 1 << 30;
/// Maximum number of channels in a file. Tandem's recordings have fewer than a hundred.
const MAX_CHANNELS: usize = 4096;

/// The texts of a metadata record.
pub type Entries = BTreeMap<String, String>;

/// A checked recording, with the positions of its parts.
pub struct CheckedFile {
    bytes: Vec<u8>,
    chunks: Vec<ChunkPlace>,
    attachments: Vec<AttachmentPlace>,
    metadata: BTreeMap<String, Entries>,
    /// Topic and number of every channel.
    channels: BTreeSet<(String, u16)>,
    uncovered: Vec<String>,
}

impl CheckedFile {
    /// Checks every byte of a file.
    pub fn new(bytes: Vec<u8>) -> Result<CheckedFile, Damage> {
        let mut data = DataSection::begin(&bytes)?;
        let (mut chunks, mut attachments) = (Vec::new(), Vec::new());
        let (mut metadata, mut channels) = (BTreeMap::new(), BTreeSet::new());
        while let Some(part) = data.next_part()? {
            match part {
                DataPart::Chunk(place, records) => {
                    for record in records.iter() {
                        if let (_, Record::Channel(channel)) = record.map_err(|fault| place.damaged(fault))? {
                            channels.insert((channel.topic, channel.id));
                            if channels.len() > MAX_CHANNELS {
                                let (has, most) = (channels.len() as u64, MAX_CHANNELS as u64);
                                return Err(place.damaged(Fault::TooMuch { has, most }));
                            }
                        }
                    }
                    chunks.push(place);
                }
                DataPart::Attachment(place) => attachments.push(place),
                DataPart::Metadata(record) => drop(metadata.insert(record.name, record.metadata)),
            }
        }
        let data_is_covered = data.check_end()?;
        let summary_is_covered = check_summary(&bytes, data.position(), data.is_own())?;
        let uncovered = uncovered(data_is_covered, summary_is_covered, data.without_checksum);
        Ok(CheckedFile { bytes, chunks, attachments, metadata, channels, uncovered })
    }

    /// Returns the parts that no checksum covers; empty for files that Tandem wrote.
    pub fn uncovered(&self) -> &[String] {
        &self.uncovered
    }

    /// Returns the metadata record called `name`.
    pub fn metadata(&self, name: &str) -> Option<&Entries> {
        self.metadata.get(name)
    }

    /// Returns the attachment called `name`, and its bytes.
    pub fn attachment(&self, name: &str) -> Option<(&AttachmentPlace, &[u8])> {
        let place = self.attachments.iter().find(|place| place.name == name)?;
        Some((place, &self.bytes[place.data.clone()]))
    }

    /// Returns the messages of a topic; `read` converts each from its time in nanoseconds and its content.
    pub fn messages<T>(
        &self,
        topic: &str,
        read: impl Fn(u64, &[u8]) -> T,
    ) -> impl Iterator<Item = Result<T, Damage>> {
        let of_topic = self.channels.iter().filter(|(name, _)| name == topic);
        let channels: Vec<u16> = of_topic.map(|(_, channel)| *channel).collect();
        let mut topic_bytes = 0;
        self.chunks.iter().flat_map(move |place| {
            let records = match place.open(&self.bytes) {
                Ok(records) => records,
                Err(damage) => return vec![Err(damage)],
            };
            let messages = records.iter().filter_map(|record| match record {
                Ok((_, Record::Message { header, data })) => {
                    channels.contains(&header.channel_id).then(|| {
                        topic_bytes += data.len();
                        match topic_bytes > MAX_TOPIC_BYTES {
                            true => {
                                let (has, most) = (topic_bytes as u64, MAX_TOPIC_BYTES as u64);
                                Err(place.damaged(Fault::TooMuch { has, most }))
                            }
                            false => Ok(read(header.log_time, &data)),
                        }
                    })
                }
                Ok(_) => None,
                Err(fault) => Some(Err(place.damaged(fault))),
            });
            messages.collect()
        })
    }
}

/// Checks the bytes from `start`, the end of the data, to the mark at the end of the file. Returns `true` if
/// a checksum covers them.
fn check_summary(bytes: &[u8], start: usize, own: bool) -> Result<bool, Damage> {
    let footer = FilePart::Record(op::FOOTER);
    let offset = bytes.len().saturating_sub(FOOTER_RECORD.len() + FOOTER_BYTES + MAGIC.len());
    let Some(end) = bytes.get(offset..).filter(|_| offset >= start) else {
        return Err(Fault::Missing.of(footer, start));
    };
    if !end.ends_with(MAGIC) {
        return Err(Fault::Unexpected.of(FilePart::Magic, bytes.len() - MAGIC.len()));
    }
    if !end.starts_with(&FOOTER_RECORD) {
        return Err(Fault::Unexpected.of(footer, offset));
    }
    let fields = &end[FOOTER_RECORD.len()..];
    let saved = u32::from_le_bytes(std::array::from_fn(|index| fields[2 * size_of::<u64>() + index]));
    let summed = &bytes[start..offset + FOOTER_RECORD.len() + 2 * size_of::<u64>()];
    is_covered(saved, summed, own).map_err(|fault| fault.of(FilePart::Summary, start))
}

/// Describes the parts that no checksum covers.
fn uncovered(data: bool, summary: bool, without: WithoutChecksum) -> Vec<String> {
    let WithoutChecksum { chunks, attachments, metadata } = without;
    let of_data = [
        (true, "header and message indexes".into()),
        (chunks > 0, format!("{chunks} chunks")),
        (attachments > 0, format!("{attachments} attachments")),
        (metadata > 0, format!("{metadata} metadata records")),
    ];
    let of_data = of_data.into_iter().filter(|(is, _)| *is && !data);
    let of_summary = std::iter::once((!summary, "the summary".to_string())).filter(|(is, _)| *is);
    of_data.chain(of_summary).map(|(_, what)| what).collect()
}
