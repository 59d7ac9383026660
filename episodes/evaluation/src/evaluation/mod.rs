//! Evaluations: play episodes over seeds in parallel worlds, store each result, and count outcomes.

mod cache;
mod identity;
mod plan;
mod planned;
mod retry;
mod run_folder;
mod summary;
#[cfg(test)]
mod tests;
mod workers;

use std::path::{Path, PathBuf};

use tandem_episodes::{EpisodeError, EpisodeSpec, OutputError, write_whole};

use crate::results::{EPISODES, PlayedEpisode, ProcessRecord};
use cache::EpisodeCache;
use run_folder::EvaluationFolder;

pub use crate::results::SeedList;
pub use identity::{RunIdentity, default_folder};
pub use plan::{EvaluationPlan, ExistingRun, KeptFiles, SeedKey, Shard, Starts, training_seeds};
pub use planned::{PlannedEpisodes, RunState};
pub use retry::{FailedEpisode, failed_episodes};
pub use run_folder::{OtherRun, is_being_played};
pub use summary::{Evaluation, TaskSummary};

/// Reason why an evaluation stopped. Played episodes are cached, and the next run continues from there.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write {path}: {source}; give a folder on a disk with space that may be written to")]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{task} seed {seed} could not be recorded: {reason}; what was played before is kept, and the same \
         command goes on from there"
    )]
    Recording { task: String, seed: u32, reason: String },
    #[error("an episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("{0}")]
    OtherRun(Box<OtherRun>),
    #[error(
        "{folder} is being played by another process, so nothing of it is deleted; wait for it, end it, or \
         give --out (in Python `out`) for another folder"
    )]
    InUse { folder: PathBuf },
    #[error(
        "{path} does not say which run its folder holds ({reason}); give --out (in Python `out`) for another \
         folder, or delete that file if all episodes there are of this run"
    )]
    UnreadableRun { path: PathBuf, reason: String },
    #[error(
        "{reason}, and run the same command again: of {planned} episodes {kept} are played and kept, and it \
         goes on with the others"
    )]
    PolicyAbsent { reason: String, kept: usize, planned: usize },
}

impl EvaluationError {
    /// Returns the error with the number of planned episodes and the number of episodes in the cache.
    fn after(self, kept: usize, planned: usize) -> EvaluationError {
        match self {
            EvaluationError::PolicyAbsent { reason, .. } => {
                EvaluationError::PolicyAbsent { reason, kept, planned }
            }
            EvaluationError::Episode(_)
            | EvaluationError::Output(_)
            | EvaluationError::Io { .. }
            | EvaluationError::Recording { .. }
            | EvaluationError::Json(_)
            | EvaluationError::OtherRun(_)
            | EvaluationError::InUse { .. }
            | EvaluationError::UnreadableRun { .. } => self,
        }
    }
}

impl From<OtherRun> for EvaluationError {
    fn from(other: OtherRun) -> EvaluationError {
        EvaluationError::OtherRun(Box::new(other))
    }
}

/// Outcome of one episode of the plan, for progress reports.
#[derive(Clone, Copy, Debug)]
pub enum EpisodeEvent<'a> {
    /// An earlier run has played it.
    Kept(&'a PlayedEpisode),
    Played(&'a PlayedEpisode),
    /// It could not be started.
    LeftOut,
}

/// Plays the episodes of the plan's share that are missing in `folder`, and writes `results.json` there.
/// Calls `progress` after each episode of the share.
///
/// # Errors
///
/// If the folder belongs to another run or cannot be written, or an episode cannot be played.
pub fn evaluate(
    plan: &EvaluationPlan,
    folder: &Path,
    progress: &(dyn Fn(EpisodeEvent) + Sync),
) -> Result<Evaluation, EvaluationError> {
    EvaluationRun::begin(plan, folder)?.play(progress)
}

/// An evaluation in its folder, in which this process plays episodes.
pub struct EvaluationRun<'a> {
    folder: &'a Path,
    place: EvaluationFolder,
    cache: EpisodeCache<'a>,
    work: Vec<EpisodeSpec>,
    /// Names of the episodes that have no demonstration to begin in.
    undemonstrated: Vec<String>,
}

/// State of a run before it plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptEpisodes {
    /// Number of cached episodes.
    pub kept: usize,
    /// Number of cached episodes that another build has played.
    pub of_other_builds: usize,
    pub to_play: usize,
    /// Number of episodes whose result this build cannot parse. They are played again, and the results
    /// replaced.
    pub unreadable: usize,
}

impl<'a> EvaluationRun<'a> {
    /// Creates the run in `folder`, or continues it there.
    ///
    /// # Errors
    ///
    /// Returns [`EvaluationError::OtherRun`] if the folder contains another run, which remains unchanged.
    pub fn begin(plan: &'a EvaluationPlan, folder: &'a Path) -> Result<EvaluationRun<'a>, EvaluationError> {
        let build = tandem_episodes::build().map_err(EpisodeError::Build)?;
        let locomotion = plan.locomotion.load().map_err(EpisodeError::from)?.name();
        let identity = RunIdentity::of_plan(plan, &locomotion, build);
        let place = EvaluationFolder::open(folder, &identity, plan.existing)?;
        let builds = place.builds.clone();
        let cache = EpisodeCache { plan, folder: folder.join(EPISODES), locomotion, build, builds };
        let (work, undemonstrated) = plan.episodes();
        Ok(EvaluationRun { folder, place, cache, work, undemonstrated })
    }

    /// Returns `true` if two processes in this folder would not detect each other.
    pub fn is_without_locks(&self) -> bool {
        self.place.without_locks
    }

    /// Returns the numbers of cached episodes and of episodes to play.
    pub fn kept(&self) -> KeptEpisodes {
        let found: Vec<PlayedEpisode> = self.work.iter().filter_map(|spec| self.cache.load(spec)).collect();
        let of_other_builds = found.iter().filter(|played| played.build != self.cache.build).count();
        let unreadable = self.work.iter().filter(|spec| self.cache.is_unreadable(spec)).count();
        KeptEpisodes {
            kept: found.len(),
            of_other_builds,
            to_play: self.work.len() - found.len(),
            unreadable,
        }
    }

    /// Returns the summary of the episodes that are in the cache.
    pub fn so_far(&self) -> Evaluation {
        let episodes = self.work.iter().filter_map(|spec| self.cache.load(spec)).collect();
        summary::summarise(&self.cache, episodes, self.undemonstrated.clone())
    }

    /// Plays the episodes that are not in the cache, and writes `results.json`. Calls `progress` after each
    /// episode.
    ///
    /// # Errors
    ///
    /// If an episode or a file fails. Episodes in the cache are kept.
    pub fn play(&self, progress: &(dyn Fn(EpisodeEvent) + Sync)) -> Result<Evaluation, EvaluationError> {
        let shard = self.cache.plan.shard;
        let planned =
            PlannedEpisodes { episodes: self.work.len(), left_out: 0, state: Some(RunState::Playing) };
        planned.write(self.folder, shard)?;
        if self.kept().to_play > 0 {
            ProcessRecord::here(self.cache.build).append(self.folder)?;
        }
        let mut left_out = self.undemonstrated.clone();
        let played = workers::play_all(&self.cache, &self.work, &mut left_out, progress);
        let state = if played.is_ok() { RunState::Complete } else { RunState::Stopped };
        let left_out_count = left_out.len() - self.undemonstrated.len();
        let ended = PlannedEpisodes { left_out: left_out_count, state: Some(state), ..planned };
        let told = ended.write(self.folder, shard);
        let evaluation = summary::summarise(&self.cache, played?, left_out);
        told?;
        let text = serde_json::to_string_pretty(&evaluation)?;
        write_whole(&self.folder.join(results_name(shard)), text.as_bytes())?;
        Ok(evaluation)
    }
}

/// Returns the name of a share's results file. Several shares may use one folder.
fn results_name(shard: Shard) -> String {
    match shard {
        Shard::WHOLE => "results.json".into(),
        Shard { index, of } => format!("results-{index}-of-{of}.json"),
    }
}
