//! Journal file of an episode: a heading line, then one line for each group of calls that were answered
//! together.
//!
//! An incomplete line is ignored, so an action and its answer are either both recorded or both missing.

use std::{
    error::Error,
    fs::{self, File, OpenOptions},
    io::{self, BufRead, BufReader, Write},
    path::{Path, PathBuf},
};

use serde::{Deserialize, Serialize};
use serde_json::{
    Value,
    value::{RawValue, to_raw_value},
};
use tandem_episodes::{EpisodeSpec, JournalEntry, Visibility};
use tandem_tools_spec::{
    Call, Driving, Heard, Note, Observation, Partner, Presence, StartEpisode, StartReply,
};

use crate::{hosting::Answer, settings::Durability};

/// Version of the format. Builds with different versions cannot read each other's lines.
const FORMAT: u32 = 1;

/// Initial size of a line's buffer in bytes. It suffices for most lines, which hold a robot's state and the
/// request.
const USUAL_LINE_BYTES: usize = 8 << 10;

/// Description of an episode and of its start.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct Heading {
    format: u32,
    /// Build of the server that began the episode.
    pub build: String,
    pub spec: EpisodeSpec,
    pub visibility: Visibility,
    pub driving: Driving,
    /// Reply to the start, including the tokens.
    pub start: StartReply,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<StartKey>,
}

/// Idempotency key of a start, and the arguments of the start.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct StartKey {
    pub key: String,
    pub args: StartEpisode,
}

/// A call with an idempotency key. Its answer is kept for repeated requests.
#[derive(Debug, Clone)]
pub struct Keyed {
    pub key: String,
    pub request: Call,
}

/// A line of a journal: requests that were answered together, the answers and notes with an idempotency key,
/// and the host's memory if it has changed.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Commit {
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub asked: Vec<JournalEntry>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub answers: Vec<KeptAnswer>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<KeyedNote>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub memory: Option<Value>,
}

/// A note with an idempotency key, under which it is recorded once.
#[derive(Debug, Serialize, Deserialize)]
pub struct KeyedNote {
    pub key: String,
    pub note: Note,
}

/// An answer and the request that it answers.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct KeptAnswer {
    pub key: String,
    tool: String,
    arguments: Box<RawValue>,
    reply: Box<RawValue>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    step: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    observation: Option<Observation>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    partners: Vec<Partner>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    presence: Vec<Presence>,
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    heard: Vec<Heard>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    recording_failed: Option<String>,
    #[serde(default)]
    others_play_on: bool,
}

/// A journal that is open for writing.
#[derive(Debug)]
pub struct JournalFile {
    path: PathBuf,
    file: File,
    durability: Durability,
}

/// A journal that is read line by line.
pub struct JournalReader {
    pub heading: Heading,
    lines: BufReader<File>,
    /// Total length in bytes of the complete lines read so far.
    whole_bytes: u64,
}

impl Heading {
    pub fn new(
        build: &str,
        spec: EpisodeSpec,
        visibility: Visibility,
        driving: &Driving,
        start: StartReply,
        key: Option<StartKey>,
    ) -> Heading {
        Heading { format: FORMAT, build: build.into(), spec, visibility, driving: *driving, start, key }
    }
}

impl Commit {
    pub fn is_empty(&self) -> bool {
        let Commit { asked, answers, notes, memory } = self;
        asked.is_empty() && answers.is_empty() && notes.is_empty() && memory.is_none()
    }
}

impl KeptAnswer {
    /// Converts the answer to `keyed` into its stored form.
    pub fn new(keyed: &Keyed, answer: &Answer) -> Result<KeptAnswer, serde_json::Error> {
        Ok(KeptAnswer {
            key: keyed.key.clone(),
            tool: keyed.request.name().into(),
            arguments: to_raw_value(&keyed.request)?,
            reply: to_raw_value(&answer.reply)?,
            step: answer.step,
            observation: answer.observation.clone(),
            partners: answer.partners.clone(),
            presence: answer.presence.clone(),
            heard: answer.heard.clone(),
            recording_failed: answer.recording_failed.clone(),
            others_play_on: answer.others_play_on,
        })
    }

    /// Parses the request and the answer.
    pub fn read(self) -> Result<(Call, Answer), Box<dyn Error>> {
        let request = Call::parse(&self.tool, serde_json::from_str(self.arguments.get())?)?;
        let reply = request.tool.parse_reply(serde_json::from_str(self.reply.get())?)?;
        let KeptAnswer {
            step, observation, partners, presence, heard, recording_failed, others_play_on, ..
        } = self;
        let answer =
            Answer { reply, step, observation, partners, presence, heard, recording_failed, others_play_on };
        Ok((request, answer))
    }
}

impl JournalFile {
    /// Creates the journal at `path` and writes its heading.
    pub fn create(path: &Path, heading: &Heading, durability: Durability) -> io::Result<JournalFile> {
        let file = private_file(path)?;
        let mut journal = JournalFile { path: path.into(), file, durability };
        match journal.append(heading) {
            Ok(()) => Ok(journal),
            Err(error) => {
                // A journal with an incomplete heading is useless.
                let _ = journal.remove();
                Err(error)
            }
        }
    }

    /// Opens a journal that has been read to its end for appending.
    pub fn go_on(path: &Path, read: JournalReader, durability: Durability) -> io::Result<JournalFile> {
        let file = OpenOptions::new().append(true).open(path)?;
        file.set_len(read.whole_bytes)?;
        Ok(JournalFile { path: path.into(), file, durability })
    }

    /// Appends a line. The journal must not be used after an error.
    pub fn append(&mut self, line: &impl Serialize) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(USUAL_LINE_BYTES);
        serde_json::to_writer(&mut bytes, line)?;
        bytes.push(b'\n');
        self.file.write_all(&bytes)?;
        match self.durability {
            Durability::System => Ok(()),
            Durability::Disk => self.file.sync_data(),
        }
    }

    /// Removes the journal, so that the episode cannot be restored.
    pub fn remove(self) -> io::Result<()> {
        fs::remove_file(&self.path)
    }
}

impl JournalReader {
    /// Opens the journal at `path` and reads its heading.
    pub fn open(path: &Path) -> io::Result<JournalReader> {
        let mut lines = BufReader::new(File::open(path)?);
        let (heading, bytes) = read_line::<Heading>(&mut lines)?
            .ok_or_else(|| io::Error::other("the first line of the journal is missing"))?;
        if heading.format != FORMAT {
            let found = heading.format;
            return Err(io::Error::other(format!("the journal is of format {found}, and this is {FORMAT}")));
        }
        Ok(JournalReader { heading, lines, whole_bytes: bytes })
    }

    /// Returns the next commit, or `None` after the last complete line.
    pub fn next_commit(&mut self) -> io::Result<Option<Commit>> {
        let read = read_line(&mut self.lines)?;
        Ok(read.map(|(commit, bytes)| {
            self.whole_bytes += bytes;
            commit
        }))
    }
}

/// Creates a file that only its owner may read, because it holds tokens.
fn private_file(path: &Path) -> io::Result<File> {
    let mut options = OpenOptions::new();
    options.write(true).create(true).truncate(true);
    #[cfg(unix)]
    std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
    options.open(path)
}

/// Reads a complete line and returns it with its length in bytes. Returns `None` at the end or for an
/// incomplete line.
fn read_line<T: for<'a> Deserialize<'a>>(lines: &mut impl BufRead) -> io::Result<Option<(T, u64)>> {
    let mut line = Vec::new();
    lines.read_until(b'\n', &mut line)?;
    match line.last() {
        Some(b'\n') => Ok(Some((serde_json::from_slice(&line)?, line.len() as u64))),
        _ => Ok(None),
    }
}
