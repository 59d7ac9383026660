//! Reading of recordings: the episode's spec, every step bit for bit, phases and tool calls; and scoring
//! them again.

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
use super::topics::messages::{PhaseMessage, SetpointsMessage, StepError, ToolCallMessage};
use super::topics::notes::NoteMessage;
use super::topics::robot::setpoints_topic;
use super::topics::steps::{StepDecoder, state_of};
use super::{Recorder, checkpoint_name, metadata, topics};
use crate::error::RobotError;
use crate::output::{partial_path, shell_word};
use crate::result_file::RESULT_FILE;
use crate::scoring::{ScoreMemory, Scores, StepScore};
use crate::spec::EpisodeSpec;

/// Maximum size of a recording. Those of long episodes with images have several hundred megabytes.
pub const MAX_RECORDING_BYTES: u64 = 4 << 30;

/// A recording in memory.
pub struct Recording {
    path: PathBuf,
    file: CheckedFile,
    pub spec: EpisodeSpec,
    /// Name of the robots' base controller; files of different content have different names.
    pub locomotion: String,
    /// Build of Tandem that played the episode.
    pub build: String,
    /// `None` if the episode was interrupted.
    pub result: Option<ResultReply>,
    scores: ScoreMemory,
}

/// A recorded tool call and its reply.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedCall {
    /// Simulated time of the reply.
    pub time_s: f64,
    /// The policy's thinking time since the episode began.
    pub thought: Duration,
    pub tool: String,
    pub arguments: Value,
    /// The robot whose operator made the call; `None` if one policy directed all robots.
    pub operator: Option<String>,
    /// Information shown to a policy in the simulator's process that the benchmark withholds from its
    /// policies. `None` if the policy was shown the whole reply.
    pub shown: Option<Vec<ExtraInformation>>,
    /// The reply as JSON, without images; or the text of the problem.
    pub outcome: Result<String, String>,
}

/// Setpoints of a robot's motors in one control step.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedSetpoints {
    /// Simulated time at the end of the step.
    pub time_s: f64,
    /// Rows of `send_joint_drives`: one, or one for each physics step.
    pub rows: Vec<Vec<f32>>,
}

/// A checkpoint of the episode in its recording.
#[derive(Clone, Debug, PartialEq)]
pub struct RecordedCheckpoint {
    /// Simulated time of the checkpoint.
    pub time_s: f64,
    /// Content that [`crate::Checkpoint`] reads.
    pub bytes: Vec<u8>,
}

/// Reason why a recording cannot be read.
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
    OtherTask { path: PathBuf, what: &'static str, task: String },
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
    /// Reads a file, or the one in an episode's folder. Checks every byte of it, and that it is a recording
    /// of an episode. Steps are decoded when they are requested.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, is damaged, or is no recording of an episode.
    pub fn read(path: &Path) -> Result<Recording, RecordingError> {
        let inside = path.join(Recorder::FILE_NAME);
        let path = if inside.is_file() { &inside } else { path };
        let bytes = read_bytes(path, MAX_RECORDING_BYTES)
            .map_err(|source| RecordingError::Read { path: path.into(), source })?;
        Recording::from_bytes(path, bytes)
    }

    /// Reads the content `bytes` of `path`, as [`Recording::read`] does.
    pub fn from_bytes(path: &Path, bytes: Vec<u8>) -> Result<Recording, RecordingError> {
        let file = CheckedFile::new(bytes)
            .map_err(|source| RecordingError::Damaged { path: path.into(), source: source.into() })?;
        let json = |source| RecordingError::Json { path: path.into(), source };
        let missing = |what: &str| RecordingError::Missing { path: path.into(), what: what.into() };
        let episode = file.metadata(metadata::EPISODE).ok_or_else(|| missing(metadata::EPISODE))?;
        let entry = |name: &str| episode.get(name).ok_or_else(|| missing(name));
        let step = |source: StepError| RecordingError::Step { path: path.into(), source };
        let mut scores = BASE64_STANDARD.decode(entry(metadata::SCORES)?).map_err(|e| step(e.into()))?;
        // The flag of a spoiled phase comes last, and earlier versions did not write it. A surplus byte is
        // ignored.
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

    /// Returns the parts of the file that no checksum covers; empty for files that Tandem wrote.
    pub fn uncovered(&self) -> &[String] {
        self.file.uncovered()
    }

    /// Checks that all data for a replay can be read.
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

    /// Returns the state before the first step, then every step.
    pub fn steps(&self) -> impl Iterator<Item = Result<Step, RecordingError>> {
        let mut decoder = StepDecoder::default();
        self.step_rows().map(move |row| decoder.decode(&row?).map_err(|source| self.no_step(source)))
    }

    /// Returns the number and the state hash of every step, including the state before the first one.
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

    /// Returns the checkpoint of a phase's beginning, or of `BEGIN`; `None` if there is none.
    pub fn checkpoint(&self, what: &str) -> Option<RecordedCheckpoint> {
        let (place, bytes) = self.file.attachment(&checkpoint_name(what))?;
        Some(RecordedCheckpoint { time_s: place.log_time as f64 / 1e9, bytes: bytes.to_vec() })
    }

    /// Returns the path from which the recording was read.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the phases that the episode reached.
    ///
    /// # Errors
    ///
    /// If a message cannot be read.
    pub fn phases(&self) -> Result<Vec<PhaseReached>, RecordingError> {
        let phase = |message: Result<(f64, PhaseMessage), RecordingError>| {
            let (_, PhaseMessage { id, number, time_s }) = message?;
            Ok(PhaseReached { id, number, time_s })
        };
        self.messages(topics::PHASES).map(phase).collect()
    }

    /// Returns the tool calls of the episode in their order: those that count, which a replay makes again.
    ///
    /// # Errors
    ///
    /// If a message cannot be read.
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

    /// Returns all calls with their times, including those that do not count.
    pub(super) fn call_messages(
        &self,
    ) -> impl Iterator<Item = Result<(f64, ToolCallMessage), RecordingError>> {
        self.messages(topics::TOOL_CALLS)
    }

    /// Returns every note, with its time.
    pub(super) fn notes(&self) -> Result<Vec<(f64, NoteMessage)>, RecordingError> {
        self.messages(topics::NOTES).collect()
    }

    /// Returns the setpoints of a robot's motors for every control step in which setpoints drove it.
    ///
    /// # Errors
    ///
    /// If a message cannot be read.
    pub fn motor_setpoints(&self, robot: &str) -> Result<Vec<RecordedSetpoints>, RecordingError> {
        let setpoints = |message: Result<(f64, SetpointsMessage), RecordingError>| {
            message.map(|(time_s, message)| RecordedSetpoints { time_s, rows: message.rows })
        };
        self.messages(&setpoints_topic(robot)).map(setpoints).collect()
    }

    /// Scores the recorded steps by this build's conditions of the task.
    ///
    /// # Errors
    ///
    /// If a step cannot be read, or the recording belongs to another task.
    pub fn score(&self) -> Result<Scores, RecordingError> {
        self.score_with(|_| {})
    }

    /// Scores the recorded steps as [`Recording::score`] does, and passes every step's score to `look`.
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

    /// Checks that a step has the robots of the task, each with `links` links.
    pub(crate) fn check_fit(&self, step: &Step, links: usize) -> Result<(), RecordingError> {
        let task = &self.spec.task;
        let robots = &step.robots;
        if robots.len() != task.robots.len()
            || robots.iter().any(|robot| robot.truth.world_from_link.len() != links)
        {
            return Err(self.of_another_task("the robots of a step"));
        }
        Ok(())
    }

    fn of_another_task(&self, what: &'static str) -> RecordingError {
        RecordingError::OtherTask { path: self.path.clone(), what, task: self.spec.task.id.clone() }
    }

    /// Returns the JSON messages of a topic, each with its simulated time.
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

/// Suggests how to make a recording of the undamaged part of a file.
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
