//! Reads a recording back: what the episode was, every step bit for bit, phases and tool calls; and scores it again.

use std::path::{Path, PathBuf};
use std::time::Duration;

use base64::{Engine, prelude::BASE64_STANDARD};
use serde::de::DeserializeOwned;
use serde_json::Value;
use tandem_sim::read_bytes;
use tandem_sim::{SimError, Step};
use tandem_tools_spec::{ExtraInformation, PhaseReached, ResultReply};

use super::checked_file::CheckedFile;
use super::damage::Damage;
use super::topics::messages::{PhaseMessage, StepError, ToolCallMessage};
use super::topics::notes::NoteMessage;
use super::topics::steps::{StepDecoder, state_of};
use super::{Recorder, checkpoint_name, metadata, topics};
use crate::error::RobotError;
use crate::output::{partial_path, shell_word};
use crate::results::RESULT_FILE;
use crate::scoring::{ScoreMemory, Scores, StepScore};
use crate::spec::EpisodeSpec;

/// Largest recording that is read. Those with pictures of a long episode have some hundred megabytes.
pub const MAX_RECORDING_BYTES: u64 = 4 << 30;

/// A recording in memory.
pub struct Recording {
    path: PathBuf,
    file: CheckedFile,
    pub spec: EpisodeSpec,
    /// Which base controller the robots had; the name tells files of different content apart.
    pub locomotion: String,
    /// Which build of Tandem played it.
    pub build: String,
    /// `None` where the episode was interrupted.
    pub result: Option<ResultReply>,
    scores: ScoreMemory,
}

/// A tool call as it was made, and its answer.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedCall {
    /// When it was answered.
    pub time_s: f64,
    /// How long the policy had thought by then since the episode began.
    pub thought: Duration,
    pub tool: String,
    pub arguments: Value,
    /// The robot whose operator made it; `None` where one policy directed all.
    pub operator: Option<String>,
    /// Of what the benchmark's own policies are not shown, what a policy that was asked in the simulator's process was shown;
    /// `None` where the policy was shown the whole reply.
    pub shown: Option<Vec<ExtraInformation>>,
    /// The reply as JSON, without pictures; or the text of the problem.
    pub outcome: Result<String, String>,
}

/// A checkpoint of the episode, as its recording holds it.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedCheckpoint {
    /// The simulated time at which it was made.
    pub time_s: f64,
    /// What [`crate::Checkpoint`] reads.
    pub bytes: Vec<u8>,
}

/// Why a recording cannot be read.
#[derive(Debug, thiserror::Error)]
pub enum RecordingError {
    #[error("cannot read the recording {}: {source}", path.display())]
    Read { path: PathBuf, source: std::io::Error },
    #[error("{} is no whole recording: {source}; {}", path.display(), hint(path, source))]
    Damaged { path: PathBuf, source: Box<Damage> },
    #[error("{} has no {what}; recordings that this version of Tandem makes have it", path.display())]
    Missing { path: PathBuf, what: String },
    #[error("{}: a message or an entry is not what its name says: {source}", path.display())]
    Json { path: PathBuf, source: serde_json::Error },
    #[error("{}: {source}", path.display())]
    Step { path: PathBuf, source: StepError },
    #[error("{}: {what} are not those of an episode of {task}", path.display())]
    OtherTask { path: PathBuf, what: &'static str, task: &'static str },
    #[error("the objects of the episode cannot be read: {0}")]
    Sim(#[from] SimError),
    #[error(transparent)]
    Robot(Box<RobotError>),
}

impl From<RobotError> for RecordingError {
    fn from(error: RobotError) -> RecordingError {
        RecordingError::Robot(Box::new(error))
    }
}

impl Recording {
    /// Reads a file, or the one in an episode's folder, checks every byte of it, and that it is a recording of an episode. Steps are
    /// read as they are asked for.
    pub fn read(path: &Path) -> Result<Recording, RecordingError> {
        let inside = path.join(Recorder::FILE_NAME);
        let path = if inside.is_file() { &inside } else { path };
        let bytes = read_bytes(path, MAX_RECORDING_BYTES)
            .map_err(|source| RecordingError::Read { path: path.into(), source })?;
        Recording::from_bytes(path, bytes)
    }

    /// As [`Recording::read`], of what `path` holds.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Recording, RecordingError> {
        let file = CheckedFile::new(bytes)
            .map_err(|source| RecordingError::Damaged { path: path.into(), source: source.into() })?;
        let json = |source| RecordingError::Json { path: path.into(), source };
        let missing = |what: &str| RecordingError::Missing { path: path.into(), what: what.into() };
        let episode = file.metadata(metadata::EPISODE).ok_or_else(|| missing(metadata::EPISODE))?;
        let entry = |name: &str| episode.get(name).ok_or_else(|| missing(name));
        let step = |source: StepError| RecordingError::Step { path: path.into(), source };
        let mut scores = BASE64_STANDARD.decode(entry(metadata::SCORES)?).map_err(|e| step(e.into()))?;
        // Whether the phase has been spoiled comes last, and earlier versions did not write it; a byte too many is left.
        scores.push(0);
        let result = file.metadata(metadata::RESULT).and_then(|entries| entries.get(RESULT_FILE));
        Ok(Recording {
            path: path.into(),
            spec: serde_json::from_str(entry(metadata::SPEC)?).map_err(json)?,
            locomotion: entry(metadata::LOCOMOTION)?.clone(),
            build: entry(metadata::BUILD)?.clone(),
            result: result.map(|text| serde_json::from_str(text)).transpose().map_err(json)?,
            scores: postcard::from_bytes(&scores).map_err(|e| step(e.into()))?,
            file,
        })
    }

    /// What of the file no checksum covers; empty of what Tandem wrote.
    pub fn uncovered(&self) -> &[String] {
        self.file.uncovered()
    }

    /// Makes sure that all that a replay needs can be read.
    pub(super) fn check_replayable(&self) -> Result<(), RecordingError> {
        let what = topics::STEPS.to_string();
        let first = self.steps().next();
        first.ok_or_else(|| RecordingError::Missing { path: self.path.clone(), what })??;
        for hash in self.state_hashes() {
            hash?;
        }
        self.tool_calls()?;
        self.phases().map(drop)
    }

    /// The state before the first step, then every step.
    pub fn steps(&self) -> impl Iterator<Item = Result<Step, RecordingError>> {
        let mut decoder = StepDecoder::default();
        self.step_rows().map(move |row| decoder.decode(&row?).map_err(|source| self.no_step(source)))
    }

    /// The number and the state hash of every step, that before the first one included.
    pub fn state_hashes(&self) -> impl Iterator<Item = Result<(u64, String), RecordingError>> {
        self.step_rows().map(|row| state_of(&row?).map_err(|source| self.no_step(source)))
    }

    fn step_rows(&self) -> impl Iterator<Item = Result<Vec<u8>, RecordingError>> {
        self.file.messages(topics::STEPS, |_, row| row.to_vec()).map(|row| row.map_err(|e| self.damaged(e)))
    }

    fn no_step(&self, source: StepError) -> RecordingError {
        RecordingError::Step { path: self.path.clone(), source }
    }

    fn damaged(&self, source: Damage) -> RecordingError {
        RecordingError::Damaged { path: self.path.clone(), source: source.into() }
    }

    /// The checkpoint of `what`: a phase's beginning, or `BEGIN`; `None` where there is none.
    pub fn checkpoint(&self, what: &str) -> Option<RecordedCheckpoint> {
        let (place, bytes) = self.file.attachment(&checkpoint_name(what))?;
        Some(RecordedCheckpoint { time_s: place.log_time as f64 / 1e9, bytes: bytes.to_vec() })
    }

    /// Where it was read from.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The phases that the episode reached.
    pub fn phases(&self) -> Result<Vec<PhaseReached>, RecordingError> {
        let phase = |message: Result<(f64, PhaseMessage), RecordingError>| {
            let (_, PhaseMessage { id, number, time_s }) = message?;
            Ok(PhaseReached { id, number, time_s })
        };
        self.messages(topics::PHASES).map(phase).collect()
    }

    /// The tool calls of the episode, in their order: those that count, which a replay makes again.
    pub fn tool_calls(&self) -> Result<Vec<RecordedCall>, RecordingError> {
        let call = |message: Result<(f64, ToolCallMessage), RecordingError>| {
            let (time_s, message) = message?;
            let ToolCallMessage { tool, thought_ns, arguments, operator, shown, ok, reply, .. } = message;
            let arguments = serde_json::from_str(&arguments).map_err(|source| self.json(source))?;
            let (thought, outcome) =
                (Duration::from_nanos(thought_ns), if ok { Ok(reply) } else { Err(reply) });
            let shown = shown.map(serde_json::to_value).map(|shown| shown.and_then(serde_json::from_value));
            let shown = shown.transpose().map_err(|source| self.json(source))?;
            Ok(RecordedCall { time_s, thought, tool, arguments, operator, shown, outcome })
        };
        let counted = |message: &Result<(f64, ToolCallMessage), RecordingError>| {
            message.as_ref().map_or(true, |(_, message)| message.counted)
        };
        self.call_messages().filter(counted).map(call).collect()
    }

    /// All that was asked, what does not count included, with the time of each.
    pub(super) fn call_messages(
        &self,
    ) -> impl Iterator<Item = Result<(f64, ToolCallMessage), RecordingError>> {
        self.messages(topics::TOOL_CALLS)
    }

    /// Every note, with its time.
    pub(super) fn notes(&self) -> Result<Vec<(f64, NoteMessage)>, RecordingError> {
        self.messages(topics::NOTES).collect()
    }

    /// Scores the recorded steps by the task's conditions as this build has them.
    pub fn score(&self) -> Result<Scores, RecordingError> {
        self.score_with(|_| {})
    }

    /// As [`Recording::score`], and lets `look` see every step's score.
    pub fn score_with(&self, mut look: impl FnMut(&StepScore)) -> Result<Scores, RecordingError> {
        let mut steps = self.steps();
        let missing = || RecordingError::Missing { path: self.path.clone(), what: topics::STEPS.into() };
        let start = steps.next().ok_or_else(missing)??;
        let model = self.spec.robot.model()?;
        let links = model.links.len();
        self.check_fit(&start, links)?;
        let mut scores = self.spec.task.scores(&model, &start)?;
        if !scores.set_memory(self.scores.clone()) {
            return Err(self.of_another_task("the scores at its beginning"));
        }
        for step in steps {
            let step = step?;
            self.check_fit(&step, links)?;
            if !scores.sees(&step) {
                return Err(self.of_another_task("the objects of a step"));
            }
            look(&scores.update(&step));
        }
        Ok(scores)
    }

    /// Makes sure that a step has the robots of the task, each with so many links.
    pub(crate) fn check_fit(&self, step: &Step, links: usize) -> Result<(), RecordingError> {
        let task = self.spec.task;
        let robots = &step.robots;
        if robots.len() != task.robots.len()
            || robots.iter().any(|robot| robot.truth.world_from_link.len() != links)
        {
            return Err(self.of_another_task("the robots of a step"));
        }
        Ok(())
    }

    fn of_another_task(&self, what: &'static str) -> RecordingError {
        RecordingError::OtherTask { path: self.path.clone(), what, task: self.spec.task.id }
    }

    /// The JSON messages of a topic, with the simulated time of each.
    fn messages<T: DeserializeOwned>(
        &self,
        topic: &str,
    ) -> impl Iterator<Item = Result<(f64, T), RecordingError>> {
        let read = |log_time: u64, content: &[u8]| (log_time as f64 / 1e9, serde_json::from_slice(content));
        self.file.messages(topic, read).map(move |message| {
            let (time_s, content) = message.map_err(|source| self.damaged(source))?;
            Ok((time_s, content.map_err(|source| self.json(source))?))
        })
    }

    fn json(&self, source: serde_json::Error) -> RecordingError {
        RecordingError::Json { path: self.path.clone(), source }
    }
}

/// How what is whole of a recording may become a recording.
fn hint(path: &Path, damage: &Damage) -> String {
    match path.extension() {
        _ if damage.is_of_another_format() => "it is no MCAP file; give an episode.mcap".into(),
        Some(extension) if extension == "partial" => {
            let partial = shell_word(&path.to_string_lossy());
            format!("`tandem recover {partial}` may make one of what comes before")
        }
        _ => {
            let partial = shell_word(&partial_path(path).to_string_lossy());
            format!(
                "rename it to {partial}, and `tandem recover {partial}` may make one of what comes before"
            )
        }
    }
}
