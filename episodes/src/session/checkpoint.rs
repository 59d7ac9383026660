//! Checkpoints: the state of an episode at one instant, from which it can continue. A checkpoint is in
//! memory, or in a file for the same build.
//!
//! The file starts with one line of JSON that identifies the episode, so that `head -1` shows it. The
//! progress follows.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use serde::{Deserialize, Serialize};
use tandem_sim::Snapshot;
use tandem_sim::read_bytes;
use tandem_tools_spec::EndReason;
use xxhash_rust::xxh3::xxh3_64;

use super::{Session, this_build, told::ShownInformation};
use crate::commands::{Executed, MotionState, TargetCounts};
use crate::error::{CheckpointError, EpisodeError};
use crate::output::write_whole;
use crate::recording::{Recording, RecordingError};
use crate::scoring::ScoreMemory;
use crate::spec::{EpisodeSpec, PhaseStart};
use crate::stress::ExecutionMemory;

/// Maximum size of a checkpoint's file; typical files have some hundred kilobytes.
const MAX_CHECKPOINT_BYTES: u64 = 64 << 20;

/// The state of an episode at one instant. It fits episodes with the same task, seed, protocol, robot,
/// controller and sensing, and with the same information for the policy.
#[derive(Clone)]
pub struct Checkpoint {
    origin: Origin,
    progress: Progress,
    /// The step after the checkpoint, if the simulator failed in that step.
    pub(super) failed: Option<FailedStep>,
}

/// The step in which the simulator failed.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FailedStep {
    /// Step number in the episode, and the error.
    pub failure: String,
    /// Commands of the step.
    #[serde(flatten)]
    pub executed: Executed,
}

/// The episode to which progress belongs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Origin {
    pub spec: EpisodeSpec,
    /// Names of robot and controller, which distinguish files of different content.
    pub robot: String,
    pub locomotion: String,
}

/// The variable state of an episode.
#[derive(Clone, Serialize, Deserialize)]
struct Progress {
    world: Snapshot,
    motions: Vec<MotionState>,
    scores: ScoreMemory,
    /// Control steps of the world before the episode.
    steps_before: u64,
    tool_calls: u32,
    requests: Option<u32>,
    thought: Duration,
    ended: Option<EndReason>,
    /// Information shown to the policy.
    shown: ShownInformation,
    /// Departures from the benchmark in the policy's commands.
    departures: BTreeSet<String>,
    targets: TargetCounts,
    /// Memory of delayed or disturbed execution; `None` without them.
    execution: Option<ExecutionMemory>,
}

/// First line of a file.
#[derive(Serialize, Deserialize)]
struct Header {
    build: String,
    #[serde(flatten)]
    origin: Origin,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    failed: Option<FailedStep>,
    /// Length of the progress, and its hash.
    bytes: usize,
    xxh3: String,
}

impl Checkpoint {
    /// Writes the checkpoint to a file. A reader sees the whole file or no file.
    pub fn write(&self, path: &Path) -> Result<(), EpisodeError> {
        Ok(write_whole(path, &self.to_bytes()?)?)
    }

    /// Returns the content of the checkpoint's file.
    pub fn to_bytes(&self) -> Result<Vec<u8>, EpisodeError> {
        let progress = postcard::to_stdvec(&self.progress).map_err(CheckpointError::from)?;
        let header = Header {
            build: this_build()?.into(),
            origin: self.origin.clone(),
            failed: self.failed.clone(),
            bytes: progress.len(),
            xxh3: hash(&progress),
        };
        let mut bytes = serde_json::to_vec(&header).map_err(crate::OutputError::from)?;
        bytes.push(b'\n');
        bytes.extend(progress);
        Ok(bytes)
    }

    /// Reads a file written by this build.
    pub fn read(path: &Path) -> Result<Checkpoint, EpisodeError> {
        let bytes = read_bytes(path, MAX_CHECKPOINT_BYTES)
            .map_err(|source| CheckpointError::Read { path: path.into(), source })?;
        Checkpoint::from_bytes(&bytes, path)
    }

    /// Reads the checkpoint at the beginning of a phase from a recording made by this build.
    pub fn of_phase(start: &PhaseStart) -> Result<Checkpoint, EpisodeError> {
        let PhaseStart { recording: path, phase } = start;
        let recording = Recording::read(path).map_err(unreadable)?;
        match recording.checkpoint(phase) {
            Some(found) => Checkpoint::from_bytes(&found.bytes, path),
            None => Err(CheckpointError::NoPhase { path: path.clone(), phase: phase.clone() }.into()),
        }
    }

    /// Parses the content of the file at `path`.
    pub fn from_bytes(bytes: &[u8], path: &Path) -> Result<Checkpoint, EpisodeError> {
        let line = bytes.iter().position(|byte| *byte == b'\n').unwrap_or(bytes.len());
        let header: Header = serde_json::from_slice(&bytes[..line])
            .map_err(|source| CheckpointError::NotOne { path: path.into(), source })?;
        let this = this_build()?;
        if header.build != this {
            let (made_by, episode) = (header.build, header.origin.episode());
            return Err(CheckpointError::OtherBuild { path: path.into(), made_by, episode, this }.into());
        }
        let progress = bytes.get(line + 1..).unwrap_or_default();
        if (progress.len(), hash(progress)) != (header.bytes, header.xxh3) {
            let (have, expected) = (progress.len().min(header.bytes), header.bytes);
            return Err(CheckpointError::Torn { path: path.into(), have, expected }.into());
        }
        let progress = postcard::from_bytes(progress).map_err(CheckpointError::from)?;
        Ok(Checkpoint { origin: header.origin, progress, failed: header.failed })
    }

    /// Returns the spec of the checkpoint's episode.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.origin.spec
    }

    /// Returns the step after the checkpoint, if the simulator failed in it.
    pub fn failed(&self) -> Option<&FailedStep> {
        self.failed.as_ref()
    }
}

impl Origin {
    /// Describes all settings that must be equal for the progress to fit.
    fn episode(&self) -> String {
        let (task, seed, protocol) = (&self.spec.task.id, self.spec.world_seed(), self.spec.protocol.name());
        let (machine, told) = (self.machine(), self.told());
        format!("task {task} seed {seed} under the {protocol} protocol with {machine}, and {told}")
    }

    /// Describes the information for the policy. It must be the same, since a policy remembers the texts that
    /// it has read.
    fn told(&self) -> String {
        let EpisodeSpec { assistance, disclosure, hints, instructions, camera, .. } = &self.spec;
        let words = instructions.as_ref().map_or("of the task", |words| &words.xxh3);
        let camera = camera.name();
        format!(
            "assistance {assistance}, phases told {disclosure}, hints {hints}, instructions {words}, camera {camera}"
        )
    }

    /// Describes the episode like [`Origin::episode`], without the protocol and the information for the
    /// policy.
    fn world(&self) -> String {
        format!("task {} seed {} with {}", self.spec.task.id, self.spec.world_seed(), self.machine())
    }

    fn machine(&self) -> String {
        let scene = self.spec.scene.as_ref().map(|scene| format!(" in scene {}", scene.xxh3));
        let scene = scene.unwrap_or_default();
        let variation: String =
            self.spec.variation.departures().map(|departure| format!(", {departure}")).collect();
        let stress = self.spec.stress.map(|stress| format!(", stress {stress}")).unwrap_or_default();
        let sensing = self.spec.sensing;
        let (source, sensors) = (sensing.state_estimate.name(), sensing.sensors.name());
        format!(
            "robot {}, controller {}, state estimate {source} and sensors {sensors}{scene}{variation}{stress}",
            self.robot, self.locomotion
        )
    }
}

/// Wraps the error of an unreadable recording or part of it.
pub(super) fn unreadable(error: RecordingError) -> CheckpointError {
    CheckpointError::Recording(error.to_string())
}

fn hash(bytes: &[u8]) -> String {
    format!("{:016x}", xxh3_64(bytes))
}

impl Session {
    /// Returns a checkpoint of the current state.
    pub fn checkpoint(&self) -> Result<Checkpoint, EpisodeError> {
        let progress = Progress {
            world: self.world.snapshot()?,
            motions: self.motions.iter().map(|motion| motion.state().clone()).collect(),
            scores: self.scores.memory(),
            steps_before: self.steps_before,
            tool_calls: self.tool_calls,
            requests: self.requests,
            thought: self.clock.spent(),
            ended: self.ended,
            shown: self.shown.clone(),
            departures: self.departures.clone(),
            targets: self.targets,
            execution: self.execution.as_ref().map(|execution| execution.memory().clone()),
        };
        Ok(Checkpoint { origin: self.origin.clone(), progress, failed: None })
    }

    /// Restores a checkpoint of an episode with the same task, seed, protocol, robot, controller and
    /// sensing, and the same information for the policy. On an error the episode is unchanged.
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), EpisodeError> {
        expect_same(checkpoint.origin.episode(), self.origin.episode())?;
        self.restore(&checkpoint.progress)
    }

    /// Restores a checkpoint like [`Session::resume`], under any protocol and with any information for
    /// the policy. The whole budget is left: earlier steps and calls do not count.
    pub fn take_up(&mut self, checkpoint: &Checkpoint) -> Result<(), EpisodeError> {
        expect_same(checkpoint.origin.world(), self.origin.world())?;
        self.restore(&checkpoint.progress)?;
        self.steps_before = self.present.control_step;
        self.tool_calls = 0;
        self.requests = self.requests.map(|_| 0);
        self.shown = ShownInformation::default();
        self.departures.clear();
        self.targets = TargetCounts::default();
        self.clock.set_spent(Duration::ZERO);
        self.ended = None;
        Ok(())
    }

    fn restore(&mut self, progress: &Progress) -> Result<(), EpisodeError> {
        if progress.motions.len() != self.motions.len() || !self.scores.set_memory(progress.scores.clone()) {
            return Err(CheckpointError::OtherContent.into());
        }
        self.world.restore(&progress.world)?;
        self.present = Arc::new(self.world.present());
        self.steps_before = progress.steps_before;
        for (motion, state) in self.motions.iter_mut().zip(&progress.motions) {
            motion.set_state(state.clone());
        }
        self.tool_calls = progress.tool_calls;
        self.requests = self.requests.and(progress.requests);
        self.clock.set_spent(progress.thought);
        self.ended = progress.ended;
        self.shown = progress.shown.clone();
        self.departures.clone_from(&progress.departures);
        self.targets = progress.targets;
        if let (Some(execution), Some(memory)) = (&mut self.execution, &progress.execution) {
            execution.set_memory(memory.clone());
        }
        self.simulator_failure = None;
        self.rewind.forget();
        self.result = None;
        Ok(())
    }
}

fn expect_same(made_of: String, wanted: String) -> Result<(), CheckpointError> {
    match made_of == wanted {
        true => Ok(()),
        false => Err(CheckpointError::OtherEpisode { made_of, wanted }),
    }
}
