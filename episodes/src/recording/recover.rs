//! Recovery of a whole recording from the remains of an interrupted episode or of a damaged file.

use std::path::{Path, PathBuf};

use mcap::Attachment;
use mcap::records::Record;
use tandem_sim::read_bytes;

use super::damage::Damage;
use super::data_section::{AttachmentPlace, DataPart, DataSection};
use super::mcap_file::{RecordingStore, Visibility, writer};
use super::read::{MAX_RECORDING_BYTES, Recording, RecordingError};
use crate::output::{OutputError, write_whole_as};

/// Outcome of a recovery.
#[derive(Debug)]
pub struct Recovered {
    pub path: PathBuf,
    pub messages: u64,
    /// Simulated time of the last message.
    pub last_s: f64,
    /// `None` if everything was recovered.
    pub left_out: Option<LeftOut>,
    /// Number of metadata records without a checksum, for example those of earlier versions. They are copied
    /// unchanged.
    pub unchecked_metadata: usize,
}

/// The omitted end of a file, from the first damaged part on.
#[derive(Debug)]
pub struct LeftOut {
    pub damage: Damage,
    /// Length from the first damaged part to the end of the file.
    pub bytes: usize,
}

/// Reason why the recovery failed.
#[derive(Debug, thiserror::Error)]
pub enum RecoverError {
    #[error("{} does not end in .partial; what does not is complete, or is no recording", .0.display())]
    NotPartial(PathBuf),
    #[error("{} exists; move it away first", .0.display())]
    Exists(PathBuf),
    #[error(transparent)]
    Read(#[from] RecordingError),
    #[error("{} holds no message that can be read: {reason}", path.display())]
    Nothing { path: PathBuf, reason: String },
    #[error("what is whole of {} is not enough to be replayed: {reason}", path.display())]
    TooLittle { path: PathBuf, reason: String },
    #[error(transparent)]
    Output(#[from] OutputError),
}

impl RecoverError {
    /// Creates the error without a hint to recover: the caller is already recovering.
    fn too_little(partial: &Path, source: RecordingError) -> RecoverError {
        let reason = match source {
            RecordingError::Damaged { source, .. } => source.to_string(),
            source => source.to_string(),
        };
        RecoverError::TooLittle { path: partial.into(), reason }
    }
}

/// Writes the messages, attachments and metadata of `FILE.partial` up to the first damaged part to `FILE`,
/// with an index. The source is not changed. The result can be replayed, or nothing is written.
///
/// # Errors
///
/// If the name does not end in `.partial`, `FILE` exists, or nothing that can be replayed is left.
pub fn recover(partial: &Path) -> Result<Recovered, RecoverError> {
    let path = match partial.extension() {
        Some(extension) if extension == "partial" => partial.with_extension(""),
        _ => return Err(RecoverError::NotPartial(partial.into())),
    };
    if path.exists() {
        return Err(RecoverError::Exists(path));
    }
    let bytes = read_bytes(partial, MAX_RECORDING_BYTES)
        .map_err(|source| RecordingError::Read { path: partial.into(), source })?;
    let nothing = |reason: String| RecoverError::Nothing { path: partial.into(), reason };
    let mut data = DataSection::begin(&bytes).map_err(|damage| nothing(damage.to_string()))?;
    let mut copy = RecoveredFile::create(&path)?;
    let damage = loop {
        match data.next_part() {
            Ok(Some(part)) => copy.add(part, &bytes)?,
            // The writer recreates all records after the data section.
            Ok(None) => break None,
            Err(damage) => break Some(damage),
        }
    };
    if copy.messages == 0 {
        return Err(nothing(damage.map_or_else(|| "it has none".into(), |damage| damage.to_string())));
    }
    let left_out = damage.map(|damage| LeftOut { bytes: bytes.len() - damage.offset, damage });
    let unchecked_metadata = match data.check_end() {
        Ok(true) => 0,
        Ok(false) | Err(_) => data.without_checksum.metadata,
    };
    let (messages, last_s) = (copy.messages, copy.last_ns as f64 / 1e9);
    let path = copy.finish(partial)?;
    Ok(Recovered { path, messages, last_s, left_out, unchecked_metadata })
}

/// The whole recording while it is being written.
struct RecoveredFile {
    path: PathBuf,
    writer: mcap::Writer<RecordingStore>,
    messages: u64,
    last_ns: u64,
}

impl RecoveredFile {
    fn create(path: &Path) -> Result<RecoveredFile, OutputError> {
        // The recovery works in memory, so that a failure leaves no file behind.
        let store = RecordingStore::create(path, Visibility::After)
            .map_err(|source| OutputError::Io { path: path.into(), source })?;
        let writer = writer(store).map_err(|source| OutputError::of_recording(path, source))?;
        Ok(RecoveredFile { path: path.into(), writer, messages: 0, last_ns: 0 })
    }

    /// Adds a part of the file with the content `bytes`.
    fn add(&mut self, part: DataPart, bytes: &[u8]) -> Result<(), OutputError> {
        let written = match part {
            DataPart::Chunk(_, records) => {
                // The chunk has been checked, so all its records can be read.
                records.iter().flatten().try_for_each(|(_, record)| self.add_record(record))
            }
            DataPart::Metadata(metadata) => self.writer.write_metadata(&metadata),
            DataPart::Attachment(AttachmentPlace { log_time, create_time, name, media_type, data }) => {
                let data = bytes[data].into();
                self.writer.attach(&Attachment { log_time, create_time, name, media_type, data })
            }
        };
        written.map_err(|source| OutputError::of_recording(&self.path, source))
    }

    fn add_record(&mut self, record: Record) -> Result<(), mcap::McapError> {
        match record {
            Record::Schema { header, data } => {
                self.writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data).map(drop)
            }
            Record::Channel(channel) => self
                .writer
                .add_channel_with_id(
                    channel.id,
                    channel.schema_id,
                    &channel.topic,
                    &channel.message_encoding,
                    &channel.metadata,
                )
                .map(drop),
            Record::Message { header, data } => {
                self.messages += 1;
                self.last_ns = header.log_time;
                self.writer.write_to_known_channel(&header, &data)
            }
            // A chunk has no other records.
            _ => Ok(()),
        }
    }

    /// Renames the file to its final name, if it can be replayed.
    fn finish(mut self, partial: &Path) -> Result<PathBuf, RecoverError> {
        self.writer.finish().map_err(|source| OutputError::of_recording(&self.path, source))?;
        let store = self.writer.into_inner();
        Recording::from_bytes(partial, store.pending().to_vec())
            .and_then(|recording| recording.check_replayable())
            .map_err(|source| RecoverError::too_little(partial, source))?;
        // The source has the partial name, so the copy has a third name meanwhile.
        write_whole_as(&partial.with_extension("recovering"), &self.path, store.pending())?;
        Ok(self.path)
    }
}
