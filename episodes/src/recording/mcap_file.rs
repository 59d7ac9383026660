//! An MCAP file with typed topics, under another name until it is complete. Its bytes go to a file that
//! others can read in the meantime, or to memory until the end.

use std::{
    collections::BTreeMap,
    fmt::Debug,
    fs::{self, File},
    io::{self, Seek, SeekFrom, Write},
    marker::PhantomData,
    path::{Path, PathBuf},
    process,
};

use foxglove::{Encode, Schema};
use mcap::Attachment;
use mcap::records::MessageHeader;
use serde::{Deserialize, Serialize};

use super::{data_section::LIBRARY, metadata};
use crate::locks::{FileLock, LockKind, Locking};
use crate::output::{OutputError, partial_path, put_in_place, write_whole};

/// Size of a chunk. A chunk is compressed as one, in buffers that every open recording has.
const CHUNK_BYTES: u64 = 256 << 10;

/// A file that is being written.
pub struct McapFile {
    writer: mcap::Writer<RecordingStore>,
    path: PathBuf,
    /// Buffer that messages share.
    buffer: Vec<u8>,
    /// The same channels for viewers.
    live: Option<Box<dyn LiveRecording>>,
}

/// A channel that carries messages of one type.
pub struct Topic<M> {
    name: String,
    channel: u16,
    messages: u32,
    message: PhantomData<fn(M)>,
}

impl McapFile {
    /// Begins the file that will be `path`, in an existing folder.
    pub fn create(
        path: &Path,
        visibility: Visibility,
        live: Option<&dyn LiveViewer>,
    ) -> Result<McapFile, OutputError> {
        let store = RecordingStore::create(path, visibility)
            .map_err(|source| OutputError::Io { path: path.into(), source })?;
        let writer = writer(store).map_err(|source| OutputError::of_recording(path, source))?;
        Ok(McapFile { writer, path: path.into(), buffer: Vec::new(), live: live.map(LiveViewer::begin) })
    }

    /// Opens a topic. `metadata` describes the channel, for example the names of an array's columns.
    pub fn topic<M: Encode>(
        &mut self,
        topic: &str,
        metadata: &[(&str, &str)],
    ) -> Result<Topic<M>, OutputError> {
        let (schema, encoding) = (M::get_schema(), M::get_message_encoding());
        let metadata = string_map(metadata);
        let schema_id = match &schema {
            Some(schema) => self.writer.add_schema(&schema.name, &schema.encoding, &schema.data),
            None => Ok(0),
        };
        let channel = schema_id.and_then(|id| self.writer.add_channel(id, topic, &encoding, &metadata));
        let channel = channel.map_err(|e| self.failed(e))?;
        if let Some(live) = &mut self.live {
            live.open(LiveChannel { topic: topic.into(), encoding, schema, metadata });
        }
        Ok(Topic { name: topic.into(), channel, messages: 0, message: PhantomData })
    }

    /// Appends one message at a simulated time.
    pub fn write<M: Encode>(
        &mut self,
        topic: &mut Topic<M>,
        time_s: f64,
        message: &M,
    ) -> Result<(), OutputError>
    where
        M::Error: Send + Sync + 'static,
    {
        self.buffer.clear();
        message.encode(&mut self.buffer).map_err(|source| OutputError::Encode(source.into()))?;
        let time_ns = time_ns(time_s);
        let header = MessageHeader {
            channel_id: topic.channel,
            sequence: topic.messages,
            log_time: time_ns,
            publish_time: time_ns,
        };
        let written = self.writer.write_to_known_channel(&header, &self.buffer);
        topic.messages += 1;
        if let Some(live) = &mut self.live {
            live.send(&topic.name, time_ns, &self.buffer);
        }
        written.map_err(|e| self.failed(e))
    }

    /// Flushes everything written to the system, in whole chunks. The flushed data survives the process and
    /// can be read.
    pub fn flush(&mut self) -> Result<(), OutputError> {
        self.writer.flush().map_err(|e| self.failed(e))
    }

    /// Appends a named set of texts that belong to the whole file, with a checksum among them.
    pub fn metadata(&mut self, name: &str, entries: &[(&str, &str)]) -> Result<(), OutputError> {
        let record = metadata::with_checksum(name, string_map(entries));
        self.writer.write_metadata(&record).map_err(|e| self.failed(e))
    }

    /// Attaches the bytes of a separate file, unchanged.
    pub fn attach(&mut self, name: &str, time_s: f64, bytes: &[u8]) -> Result<(), OutputError> {
        let time_ns = time_ns(time_s);
        let attached = self.writer.attach(&Attachment {
            log_time: time_ns,
            create_time: time_ns,
            name: name.into(),
            media_type: "application/octet-stream".into(),
            data: bytes.into(),
        });
        attached.map_err(|e| self.failed(e))
    }

    /// Writes the index and gives the file its name.
    pub fn finish(mut self) -> Result<PathBuf, OutputError> {
        self.writer.finish().map_err(|e| self.failed(e))?;
        let McapFile { writer, path, .. } = self;
        writer.into_inner().keep(&path)?;
        Ok(path)
    }

    fn failed(&self, source: mcap::McapError) -> OutputError {
        OutputError::of_recording(&self.path, source)
    }
}

/// Viewer of recordings, for example a server. It is notified of every new recording.
pub trait LiveViewer: Debug + Send + Sync {
    /// Returns the view of a recording that begins.
    fn begin(&self) -> Box<dyn LiveRecording>;
}

/// View of one recording. Calls come from the recorder's thread, in the order of the file.
pub trait LiveRecording: Send {
    /// Opens a channel.
    fn open(&mut self, channel: LiveChannel);

    /// Shows a message of a channel.
    fn send(&mut self, topic: &str, time_ns: u64, message: &[u8]);
}

/// Description of a channel of a recording, as in the file.
#[derive(Clone, Debug)]
pub struct LiveChannel {
    pub topic: String,
    pub encoding: String,
    pub schema: Option<Schema>,
    /// Description of the channel, for example the names of an array's columns.
    pub metadata: BTreeMap<String, String>,
}

/// Creates a writer of whole chunks, so that no flush ends in the middle of one.
pub fn writer(store: RecordingStore) -> Result<mcap::Writer<RecordingStore>, mcap::McapError> {
    mcap::WriteOptions::new()
        .library(format!("{LIBRARY}{}", env!("CARGO_PKG_VERSION")))
        .compression(Some(mcap::Compression::Zstd))
        // The thread that writes also compresses.
        .compression_threads(0)
        .disable_seeking(true)
        .chunk_size(Some(CHUNK_BYTES))
        .create(store)
}

/// Converts a time to nanoseconds, the unit of MCAP.
pub fn time_ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

fn string_map(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
    entries.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}

/// The time from which a recording can be read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Visibility {
    /// Readable during the episode, under the name `episode.mcap.partial`.
    #[default]
    Live,
    /// The file is readable after the end. Until then nobody sees data that is withheld from policies, and a
    /// killed process leaves no file.
    After,
}

/// Bytes written since the last flush, and the sink of the next flush. A flush is one write to the system,
/// so the file on disk always ends where a flush ended.
pub struct RecordingStore {
    pending: Vec<u8>,
    flushed_bytes: u64,
    sink: Sink,
}

enum Sink {
    File {
        file: File,
        partial: PathBuf,
    },
    Memory,
    /// A flush has failed. Nothing more is written: the file on disk ends where the last successful flush
    /// ended.
    Failed,
}

impl RecordingStore {
    /// Creates a store for the file that will be `path` when it is complete. An existing file of its
    /// partial name is overwritten, unless another writer holds it.
    pub fn create(path: &Path, visibility: Visibility) -> io::Result<RecordingStore> {
        let sink = match visibility {
            Visibility::Live => {
                let (file, partial) = open_partial(path)?;
                Sink::File { file, partial }
            }
            Visibility::After => Sink::Memory,
        };
        Ok(RecordingStore { pending: Vec::new(), flushed_bytes: 0, sink })
    }

    /// Returns the bytes that have not been flushed. For a store in memory, these are all bytes.
    pub fn pending(&self) -> &[u8] {
        &self.pending
    }

    /// Writes all data to the disk under the name `path`.
    pub fn keep(mut self, path: &Path) -> Result<(), OutputError> {
        let failed = |source| OutputError::Io { path: path.into(), source };
        self.flush().map_err(failed)?;
        match &self.sink {
            Sink::File { file, partial } => put_in_place(file, partial, path).map_err(failed),
            Sink::Memory => write_whole(path, &self.pending),
            Sink::Failed => Err(failed(after_a_failure())),
        }
    }
}

/// Opens the empty file that will be `path`, locked against other writers. Returns it with its name until
/// then.
fn open_partial(path: &Path) -> io::Result<(File, PathBuf)> {
    let partial = partial_path(path);
    // On systems where a lock would also prevent others from reading, the file is not locked.
    if !cfg!(unix) {
        return Ok((File::create(&partial)?, partial));
    }
    match FileLock::attempt(&partial, LockKind::Exclusive)? {
        Locking::Locked(lock) => {
            // The lock belongs to the opened file, which both handles share.
            let file = lock.file().try_clone()?;
            file.set_len(0)?;
            Ok((file, partial))
        }
        Locking::Held => Err(io::Error::new(
            io::ErrorKind::ResourceBusy,
            format!("another episode is being recorded there, to {}", partial.display()),
        )),
        Locking::Unsupported => {
            let own = partial_path(&path.with_extension(format!("{}.mcap", process::id())));
            Ok((File::create(&own)?, own))
        }
    }
}

/// Truncates what a failed flush has written. Removes a file that was empty before.
fn leave(file: &File, partial: &Path, flushed_bytes: u64) {
    // If that fails, too, the readable part of the file is the same.
    let _ = match flushed_bytes {
        0 => fs::remove_file(partial),
        flushed_bytes => file.set_len(flushed_bytes),
    };
}

fn after_a_failure() -> io::Error {
    io::Error::other("an earlier part could not be written")
}

impl Write for RecordingStore {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.sink {
            Sink::Failed => Err(after_a_failure()),
            Sink::File { .. } | Sink::Memory => {
                self.pending.extend_from_slice(bytes);
                Ok(bytes.len())
            }
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        let Sink::File { file, partial } = &mut self.sink else { return Ok(()) };
        let written = file.write_all(&self.pending);
        if written.is_err() {
            leave(file, partial, self.flushed_bytes);
            self.sink = Sink::Failed;
        }
        self.flushed_bytes += self.pending.len() as u64;
        self.pending.clear();
        // The scene's shapes and the images of a reply are megabytes, and are rare.
        self.pending.shrink_to(CHUNK_BYTES as usize);
        written
    }
}

/// Reports the position to MCAP's writer, which is configured never to seek back.
impl Seek for RecordingStore {
    fn seek(&mut self, position: SeekFrom) -> io::Result<u64> {
        match position {
            SeekFrom::Current(0) => Ok(self.flushed_bytes + self.pending.len() as u64),
            _ => Err(io::ErrorKind::Unsupported.into()),
        }
    }
}

/// Flushes a recording that is dropped before its end, so that it stays readable up to there.
impl Drop for RecordingStore {
    fn drop(&mut self) {
        let _ = self.flush();
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn a_recording_that_is_being_written_is_nobody_elses() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("episode.mcap");
        fs::write(partial_path(&path), "left by a process that was killed").unwrap();
        let mut store = RecordingStore::create(&path, Visibility::Live).unwrap();
        let refused = RecordingStore::create(&path, Visibility::Live).map(drop).unwrap_err();
        assert!(refused.to_string().contains("another episode is being recorded there"), "{refused}");
        store.write_all(b"one").unwrap();
        store.keep(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one");
        let mut next = RecordingStore::create(&path, Visibility::Live).unwrap();
        next.write_all(b"two").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"one", "it stays until the next one is whole");
        next.keep(&path).unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"two");
    }
}
