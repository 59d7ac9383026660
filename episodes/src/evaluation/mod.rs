//! Episodes over seeds: plays them in parallel worlds, keeps each result, and counts.

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

use crate::output::{OutputError, write_whole};
use crate::results::{EPISODES, PlayedEpisode};
use crate::spec::EpisodeSpec;
use crate::{EpisodeError, fingerprint};
use cache::EpisodeCache;
use run_folder::EvaluationFolder;

pub use identity::{RunIdentity, SeedList, default_folder};
pub use plan::{EvaluationPlan, ExistingRun, KeptFiles, SeedKey, Shard, Starts, training_seeds};
pub use planned::{PlannedEpisodes, RunState};
pub use retry::{FailedEpisode, failed_episodes};
pub use run_folder::{OtherRun, is_being_played};
pub use summary::{Evaluation, TaskSummary};

/// Why an evaluation stopped. Episodes that were played are cached, and the next run goes on from there.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write {path}: {source}; give a folder on a disk with space that may be written to")]
    Io { path: PathBuf, source: std::io::Error },
    #[error(
        "{task} seed {seed} could not be recorded: {reason}; what was played before is kept, and the same command goes on from there"
    )]
    Recording { task: &'static str, seed: u32, reason: String },
    #[error("an episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("{0}")]
    OtherRun(Box<OtherRun>),
    #[error(
        "{folder} is being played by another process, so nothing of it is deleted; wait for it, end it, or give --out (in Python `out`) for another folder"
    )]
    InUse { folder: PathBuf },
    #[error(
        "{path} does not say which run its folder holds ({reason}); give --out (in Python `out`) for another folder, or delete that file if all episodes there are of this run"
    )]
    UnreadableRun { path: PathBuf, reason: String },
    #[error(
        "{reason}, and run the same command again: of {planned} episodes {kept} are played and kept, and it goes on with the others"
    )]
    PolicyAbsent { reason: String, kept: usize, planned: usize },
}

impl EvaluationError {
    /// The error as it is told when of so many `planned` episodes the next run finds `kept`.
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

/// What became of one episode of the plan.
#[derive(Clone, Copy, Debug)]
pub enum EpisodeEvent<'a> {
    /// An earlier run has played it.
    Kept(&'a PlayedEpisode),
    Played(&'a PlayedEpisode),
    /// It could not be begun.
    LeftOut,
}

/// Plays what `folder` does not hold yet of the plan's share, writes `results.json` there, and calls `progress` after each
/// episode of it.
pub fn evaluate(
    plan: &EvaluationPlan,
    folder: &Path,
    progress: &(dyn Fn(EpisodeEvent) + Sync),
) -> Result<Evaluation, EvaluationError> {
    EvaluationRun::begin(plan, folder)?.play(progress)
}

/// An evaluation whose folder is found to be its own, and in which this process plays.
pub struct EvaluationRun<'a> {
    folder: &'a Path,
    place: EvaluationFolder,
    cache: EpisodeCache<'a>,
    work: Vec<EpisodeSpec>,
    /// Those that nobody has demonstrated.
    undemonstrated: Vec<String>,
}

/// What a run has before it plays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct KeptEpisodes {
    /// Episodes that are kept.
    pub kept: usize,
    /// How many of them another build has played.
    pub of_other_builds: usize,
    pub to_play: usize,
    /// How many of these have a result that this build cannot read, and that it replaces.
    pub unreadable: usize,
}

impl<'a> EvaluationRun<'a> {
    /// Makes `folder` that of the run, or finds that it is.
    ///
    /// # Errors
    /// Returns [`EvaluationError::OtherRun`] where it holds another run, of which nothing is touched.
    pub fn begin(plan: &'a EvaluationPlan, folder: &'a Path) -> Result<EvaluationRun<'a>, EvaluationError> {
        let build = fingerprint::build().map_err(EpisodeError::Build)?;
        let locomotion = plan.locomotion.load().map_err(EpisodeError::from)?.name();
        let identity = RunIdentity::of_plan(plan, &locomotion, build);
        let place = EvaluationFolder::open(folder, &identity, plan.existing)?;
        let builds = place.builds.clone();
        let cache = EpisodeCache { plan, folder: folder.join(EPISODES), locomotion, build, builds };
        let (work, undemonstrated) = plan.episodes();
        Ok(EvaluationRun { folder, place, cache, work, undemonstrated })
    }

    /// Whether two processes in this folder would not notice each other.
    pub fn is_without_locks(&self) -> bool {
        self.place.without_locks
    }

    /// What is kept, and what there is to play.
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

    /// What is kept by now, counted.
    pub fn so_far(&self) -> Evaluation {
        let episodes = self.work.iter().filter_map(|spec| self.cache.load(spec)).collect();
        summary::summarise(&self.cache, episodes, self.undemonstrated.clone())
    }

    /// Plays what is not kept yet, writes `results.json`, and calls `progress` after each episode.
    pub fn play(&self, progress: &(dyn Fn(EpisodeEvent) + Sync)) -> Result<Evaluation, EvaluationError> {
        let shard = self.cache.plan.shard;
        let planned =
            PlannedEpisodes { episodes: self.work.len(), left_out: 0, state: Some(RunState::Playing) };
        planned.write(self.folder, shard)?;
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

/// Shares may lie in one folder.
fn results_name(shard: Shard) -> String {
    match shard {
        Shard::WHOLE => "results.json".into(),
        Shard { index, of } => format!("results-{index}-of-{of}.json"),
    }
}
