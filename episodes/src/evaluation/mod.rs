//! Episodes over seeds: plays them in parallel worlds, keeps each result, and counts.

mod cache;
mod plan;
mod planned;
mod retry;
mod summary;
#[cfg(test)]
mod tests;
mod workers;

use std::path::{Path, PathBuf};

use crate::output::{OutputError, create_private_folder, write_whole};
use crate::results::{EPISODES, PlayedEpisode};
use crate::{EpisodeError, fingerprint};
use cache::EpisodeCache;

pub use plan::{EvaluationPlan, KeptFiles, SeedKey, Shard, Starts};
pub use planned::PlannedEpisodes;
pub use retry::{FailedEpisode, failed_episodes};
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
            | EvaluationError::Json(_) => self,
        }
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
    let cached = folder.join(EPISODES);
    create_private_folder(&cached).map_err(|source| EvaluationError::Io { path: cached.clone(), source })?;
    let build = fingerprint::build().map_err(EpisodeError::Build)?;
    let locomotion = plan.locomotion.load().map_err(EpisodeError::from)?.name();
    let cache = EpisodeCache { plan, folder: &cached, locomotion, build };
    let (work, mut left_out) = plan.episodes();
    PlannedEpisodes { episodes: work.len() }.write(folder, plan.shard)?;
    let episodes = workers::play_all(&cache, &work, &mut left_out, progress)?;
    let evaluation = summary::summarise(&cache, episodes, left_out);
    let text = serde_json::to_string_pretty(&evaluation)?;
    write_whole(&folder.join(results_name(plan.shard)), text.as_bytes())?;
    Ok(evaluation)
}

/// Shares may lie in one folder.
fn results_name(shard: Shard) -> String {
    match shard {
        Shard::WHOLE => "results.json".into(),
        Shard { index, of } => format!("results-{index}-of-{of}.json"),
    }
}
