//! An MCAP file with typed topics, under another name until it is complete.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io::BufWriter,
    marker::PhantomData,
    path::{Path, PathBuf},
};

use foxglove::Encode;
use mcap::records::{MessageHeader, Metadata};

use crate::output::OutputError;

/// A file that is being written.
pub struct McapFile {
    writer: mcap::Writer<BufWriter<File>>,
    partial_path: PathBuf,
    path: PathBuf,
    /// Reused between messages.
    buffer: Vec<u8>,
}

/// A channel that carries messages of one type.
pub struct Topic<M> {
    channel: u16,
    messages: u32,
    message: PhantomData<fn(M)>,
}

impl McapFile {
    /// Opens `<name>.partial` in an existing folder; a file of that name is overwritten.
    pub fn create(folder: &Path, name: &str) -> Result<McapFile, OutputError> {
        let path = folder.join(name);
        let partial_path = folder.join(format!("{name}.partial"));
        let file = File::create(&partial_path)
            .map_err(|source| OutputError::Io { path: partial_path.clone(), source })?;
        let writer = mcap::WriteOptions::new()
            .library(concat!("tandem ", env!("CARGO_PKG_VERSION")))
            .compression(Some(mcap::Compression::Lz4))
            .create(BufWriter::new(file))
            .map_err(|source| OutputError::Mcap { path: partial_path.clone(), source })?;
        Ok(McapFile { writer, partial_path, path, buffer: Vec::new() })
    }

    /// Opens a topic. `metadata` describes the channel, as the names of an array's columns.
    pub fn topic<M: Encode>(
        &mut self,
        topic: &str,
        metadata: &[(&str, &str)],
    ) -> Result<Topic<M>, OutputError> {
        let schema = match M::get_schema() {
            Some(schema) => self.writer.add_schema(&schema.name, &schema.encoding, &schema.data),
            None => Ok(0),
        };
        let channel = schema.and_then(|schema| {
            self.writer.add_channel(schema, topic, &M::get_message_encoding(), &string_map(metadata))
        });
        Ok(Topic { channel: channel.map_err(|e| self.failed(e))?, messages: 0, message: PhantomData })
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
        written.map_err(|e| self.failed(e))
    }

    /// Appends a named set of texts that belong to the whole file.
    pub fn metadata(&mut self, name: &str, entries: &[(&str, &str)]) -> Result<(), OutputError> {
        let record = Metadata { name: name.into(), metadata: string_map(entries) };
        self.writer.write_metadata(&record).map_err(|e| self.failed(e))
    }

    /// Writes the index and gives the file its name.
    pub fn finish(mut self) -> Result<PathBuf, OutputError> {
        self.writer.finish().map_err(|e| self.failed(e))?;
        let McapFile { writer, partial_path, path, .. } = self;
        let closed = writer.into_inner().into_inner().map_err(|error| error.into_error());
        closed
            .and_then(|file| file.sync_all())
            .and_then(|()| fs::rename(&partial_path, &path))
            .map_err(|source| OutputError::Io { path: path.clone(), source })?;
        Ok(path)
    }

    fn failed(&self, source: mcap::McapError) -> OutputError {
        OutputError::Mcap { path: self.partial_path.clone(), source }
    }
}

/// MCAP counts time in nanoseconds.
pub fn time_ns(time_s: f64) -> u64 {
    (time_s * 1e9).round() as u64
}

fn string_map(entries: &[(&str, &str)]) -> BTreeMap<String, String> {
    entries.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect()
}
