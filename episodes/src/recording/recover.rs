//! Makes a whole recording of what an interrupted episode left.

use std::path::{Path, PathBuf};

use mcap::Attachment;
use mcap::read::{ChunkFlattener, Options};
use mcap::records::Record;

use super::mcap_file::{RecordingStore, Visibility, writer};
use super::read::RecordingError;
use crate::output::OutputError;

/// What could be read, and where it is now.
#[derive(Clone, Debug, PartialEq)]
pub struct Recovered {
    pub path: PathBuf,
    pub messages: u64,
    /// Simulated time of the last message.
    pub last_s: f64,
    /// Why no more could be read; `None` where the file is whole.
    pub torn: Option<String>,
}

/// Why nothing was recovered.
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
    #[error(transparent)]
    Output(#[from] OutputError),
}

/// Writes every message, attachment and all metadata of `FILE.partial` up to its last whole record to `FILE`, with an
/// index. What is read stays as it is.
pub fn recover(partial: &Path) -> Result<Recovered, RecoverError> {
    let path = match partial.extension() {
        Some(extension) if extension == "partial" => partial.with_extension(""),
        _ => return Err(RecoverError::NotPartial(partial.into())),
    };
    if path.exists() {
        return Err(RecoverError::Exists(path));
    }
    let bytes =
        std::fs::read(partial).map_err(|source| RecordingError::Read { path: partial.into(), source })?;
    let nothing = |reason: String| RecoverError::Nothing { path: partial.into(), reason };
    let records =
        ChunkFlattener::new_with_options(&bytes, Options::IgnoreEndMagic | Options::ValidateChunkCrcs);
    let mut copy = RecoveredFile::create(&path)?;
    for record in records.map_err(|error| nothing(error.to_string()))? {
        match record {
            Ok(record) => copy.add(record)?,
            Err(error) => {
                copy.torn = Some(error.to_string());
                break;
            }
        }
    }
    if copy.messages == 0 {
        return Err(nothing(copy.torn.unwrap_or_else(|| "it has none".into())));
    }
    Ok(copy.finish()?)
}

/// The whole recording, on its way.
struct RecoveredFile {
    path: PathBuf,
    writer: mcap::Writer<RecordingStore>,
    messages: u64,
    last_ns: u64,
    torn: Option<String>,
}

impl RecoveredFile {
    fn create(path: &Path) -> Result<RecoveredFile, OutputError> {
        // Nothing is left behind where nothing can be recovered.
        let store = RecordingStore::create(path, Visibility::After)
            .map_err(|source| OutputError::Io { path: path.into(), source })?;
        let writer = writer(store).map_err(|source| OutputError::Mcap { path: path.into(), source })?;
        Ok(RecoveredFile { path: path.into(), writer, messages: 0, last_ns: 0, torn: None })
    }

    fn add(&mut self, record: Record) -> Result<(), OutputError> {
        let written = match record {
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
            Record::Metadata(metadata) => self.writer.write_metadata(&metadata),
            Record::Attachment { header, data, .. } => self.writer.attach(&Attachment {
                log_time: header.log_time,
                create_time: header.create_time,
                name: header.name,
                media_type: header.media_type,
                data,
            }),
            // The rest is what the writer makes anew.
            _ => Ok(()),
        };
        written.map_err(|source| OutputError::Mcap { path: self.path.clone(), source })
    }

    fn finish(mut self) -> Result<Recovered, OutputError> {
        self.writer.finish().map_err(|source| OutputError::Mcap { path: self.path.clone(), source })?;
        self.writer.into_inner().keep(&self.path)?;
        let RecoveredFile { path, messages, last_ns, torn, .. } = self;
        Ok(Recovered { path, messages, last_s: last_ns as f64 / 1e9, torn })
    }
}
