//! Replay of a demonstration's action rows in episodes of other seeds. It needs no observations. A policy
//! that does not reach more phases than this replay has not shown any perception.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde_json::json;
use tandem_episodes::{
    EpisodeSpec, MAX_RECORDING_BYTES, Phase, Recorder, Recording, RecordingError, Start,
    players::{Episode as _, InProcess, PlayerError, recorded_action},
    rules,
    tasks::{self, Task},
};
use tandem_sim::read_bytes;
use tandem_tools_spec::{JointChunk, SendJointChunk};
use xxhash_rust::xxh3::xxh3_64;

use super::{EpisodeOutput, PlayError, PlayOutcome, Policy, play_in_process};
use crate::results::{EPISODES, OPEN_LOOP, PolicyCard};

/// Number of demonstrations per task: the second is replayed for the seed of the first.
const PER_TASK: usize = 2;

/// A policy that sends all rows of a recorded demonstration, then repeats the last row until the episode ends
/// or all phases have been reached.
#[derive(Debug)]
pub struct OpenLoop {
    demonstrations: Vec<RecordedRows>,
}

/// Action rows of one recorded episode.
#[derive(Debug)]
struct RecordedRows {
    task: Task,
    seed: u32,
    /// Hash of the file.
    xxh3: String,
    /// Rows of each control step, one for each robot.
    step_rows: Vec<Vec<Vec<f64>>>,
}

/// Reason why nothing can be replayed.
#[derive(Debug, thiserror::Error)]
pub enum OpenLoopError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(
        "cannot read {}: {source}; give an episode.mcap, or a folder that `collect` wrote",
        path.display()
    )]
    Read { path: PathBuf, source: std::io::Error },
    #[error(
        "{} holds no recording of an episode; give an episode.mcap, or a folder that `collect` wrote",
        .0.display()
    )]
    Nothing(PathBuf),
    #[error("{} begins at a checkpoint; give a recording from its task's own beginning", .0.display())]
    BeginsLater(PathBuf),
}

impl OpenLoop {
    /// Reads a recording, or the first successful recordings of every benchmark task in a folder that
    /// `collect` wrote.
    ///
    /// # Errors
    ///
    /// If the path cannot be read, contains no recording of an episode, or contains one that begins at a
    /// checkpoint.
    pub fn read(path: &Path) -> Result<OpenLoop, OpenLoopError> {
        if !path.is_dir() {
            return Ok(OpenLoop { demonstrations: vec![RecordedRows::read(path)?.0] });
        }
        let mut demonstrations = Vec::new();
        for task in tasks::cohub() {
            let mut chosen: Vec<(RecordedRows, bool)> = Vec::new();
            for path in recordings(path, task)?.into_values() {
                if chosen.iter().filter(|(_, succeeded)| *succeeded).count() == PER_TASK {
                    break;
                }
                chosen.push(RecordedRows::read(&path)?);
            }
            // Failed recordings come last; they are used only if there are too few successful ones.
            chosen.sort_by_key(|(_, succeeded)| !succeeded);
            demonstrations.extend(chosen.into_iter().take(PER_TASK).map(|(rows, _)| rows));
        }
        match demonstrations.is_empty() {
            true => Err(OpenLoopError::Nothing(path.into())),
            false => Ok(OpenLoop { demonstrations }),
        }
    }

    /// Returns the rows to replay in an episode. They were never recorded under the episode's own seed.
    fn rows(&self, spec: &EpisodeSpec) -> Result<&RecordedRows, PlayError> {
        let of_task = self.demonstrations.iter().filter(|rows| rows.task == spec.task);
        let mut others = of_task.clone().filter(|rows| rows.seed != spec.seed);
        others.next().ok_or_else(|| {
            PlayError::NotReady(match of_task.count() {
                0 => "nobody has recorded the task for open-loop".into(),
                _ => "it is what open-loop replays, which is for other seeds".into(),
            })
        })
    }
}

impl Policy for OpenLoop {
    fn card(&self) -> PolicyCard {
        let name = |rows: &RecordedRows| format!("{} {} {}", rows.task.id, rows.seed, rows.xxh3);
        let replayed: Vec<String> = self.demonstrations.iter().map(name).collect();
        PolicyCard { settings: Some(json!({ OPEN_LOOP: replayed })), ..OPEN_LOOP.into() }
    }

    fn play_episode(&self, spec: &EpisodeSpec, output: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        let rows = self.rows(spec)?;
        Ok(play_in_process(spec, output, |episode| rows.play(episode))?)
    }
}

/// Returns the recordings of a task by seed, in a folder that `collect` or `serve` wrote.
fn recordings(folder: &Path, task: &Task) -> Result<BTreeMap<u32, PathBuf>, OpenLoopError> {
    let kept = folder.join(EPISODES);
    let folder = if kept.is_dir() { &kept } else { folder };
    let failed = |source| OpenLoopError::Read { path: folder.into(), source };
    let mut found = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        let path = entry.map_err(failed)?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let seed = name.strip_prefix(task.id.as_str()).and_then(|rest| rest.strip_prefix('-'));
        let seed = seed.and_then(|rest| rest.strip_prefix("seed").unwrap_or(rest).parse::<u32>().ok());
        let recording = path.join(Recorder::FILE_NAME);
        if let Some(seed) = seed.filter(|_| recording.exists()) {
            found.insert(seed, recording);
        }
    }
    Ok(found)
}

impl RecordedRows {
    /// Reads the rows of a recording. Also returns `true` if its episode succeeded.
    fn read(path: &Path) -> Result<(RecordedRows, bool), OpenLoopError> {
        let bytes = read_bytes(path, MAX_RECORDING_BYTES)
            .map_err(|source| RecordingError::Read { path: path.into(), source })?;
        let xxh3 = format!("{:016x}", xxh3_64(&bytes));
        let recording = Recording::from_bytes(path, bytes)?;
        let EpisodeSpec { task, seed, protocol, start, .. } = &recording.spec;
        if *start != Start::Task {
            return Err(OpenLoopError::BeginsLater(path.into()));
        }
        // The initial state, and the hold before the policy's first action, are not steps of the policy.
        let before = 1 + rules(*protocol, task).initial_hold_steps as usize;
        let robots = task.robots.len();
        let row = |step: Result<tandem_sim::Step, RecordingError>| {
            step.map(|step| (0..robots).map(|robot| recorded_action(&step, robot)).collect())
        };
        let steps: Vec<_> = recording.steps().skip(before).map(row).collect::<Result<_, _>>()?;
        if steps.is_empty() {
            return Err(OpenLoopError::Nothing(path.into()));
        }
        let last = Phase::number(task.phases.len() - 1);
        let succeeded =
            recording.result.as_ref().is_some_and(|result| result.phases.reached_s(&last).is_some());
        Ok((RecordedRows { task: task.clone(), seed: *seed, xxh3, step_rows: steps }, succeeded))
    }

    /// Plays until the episode ends, or all phases have been reached.
    fn play(&self, episode: &mut InProcess) -> Result<(), PlayerError> {
        let most = rules(episode.session.spec().protocol, &self.task).steps_per_command as usize;
        let Some(last) = self.step_rows.last() else { return Ok(()) };
        let mut done = 0;
        while episode.session.reached_phases() < self.task.phases.len() {
            let steps: Vec<&Vec<Vec<f64>>> =
                (done..done + most).map(|step| self.step_rows.get(step).unwrap_or(last)).collect();
            let robots = self.task.robot_names().enumerate();
            let rows = |robot: usize| steps.iter().map(|rows| rows[robot].clone()).collect();
            let robots = robots.map(|(robot, name)| JointChunk { robot: name.into(), rows: rows(robot) });
            episode.call(SendJointChunk { robots: robots.collect() }.into())?;
            done += most;
        }
        Ok(())
    }
}
