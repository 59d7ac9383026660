//! Episodes over seeds: plays them in parallel worlds, keeps each result, and counts.

mod keep;
mod summary;
#[cfg(test)]
mod tests;
mod workers;

use std::path::{Path, PathBuf};

use tandem_tools_spec::Protocol;

use crate::output::{OutputError, create_private_folder, write_whole};
use crate::players;
use crate::spec::{Controller, EpisodeSpec, RobotFile};
use crate::tasks::Task;
use crate::{EpisodeError, fingerprint};
use keep::Keeper;
use tandem_sim::render::RendererKind;

pub use keep::Played;
pub use summary::{Evaluation, TaskSummary, clopper_pearson};

/// What to play.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Who plays.
    pub player: &'static players::Entry,
    pub protocol: Protocol,
    pub robot: RobotFile,
    pub locomotion: Controller,
    pub renderer: RendererKind,
    pub tasks: Vec<&'static Task>,
    pub seeds: Vec<u32>,
    /// Worlds that run side by side, each on a thread of its own.
    pub jobs: usize,
    /// Record every episode in a folder of its own (`episode.mcap`, `strip.png`, `report.html`).
    pub record: bool,
}

impl Plan {
    /// One of the episodes to play.
    pub fn spec(&self, task: &'static Task, seed: u32) -> EpisodeSpec {
        EpisodeSpec {
            robot: self.robot.clone(),
            locomotion: self.locomotion.clone(),
            renderer: self.renderer,
            ..EpisodeSpec::new(task, seed, self.protocol)
        }
    }
}

/// Why an evaluation stopped. Episodes that were played are kept, and the next run goes on from there.
#[derive(Debug, thiserror::Error)]
pub enum EvaluationError {
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error("cannot write {path}: {source}")]
    Io { path: PathBuf, source: std::io::Error },
    #[error("{task} seed {seed} was played and not recorded: {reason}")]
    Recording { task: &'static str, seed: u32, reason: String },
    #[error("an episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
}

const RESULTS: &str = "results.json";
const EPISODES: &str = "episodes";

/// Plays what `folder` does not hold yet, writes `results.json` there, and calls `progress` after each episode.
pub fn evaluate(
    plan: &Plan,
    folder: &Path,
    progress: &(dyn Fn(&Played) + Sync),
) -> Result<Evaluation, EvaluationError> {
    let kept = folder.join(EPISODES);
    create_private_folder(&kept).map_err(|source| EvaluationError::Io { path: kept.clone(), source })?;
    let build = fingerprint::build().map_err(EpisodeError::Build)?;
    let locomotion = plan.locomotion.load().map_err(EpisodeError::from)?.name().to_string();
    let keeper = Keeper { plan, folder: &kept, locomotion, build };
    let episodes = workers::play_all(&keeper, progress)?;
    let evaluation = summary::summarise(&keeper, episodes);
    write_whole(&folder.join(RESULTS), serde_json::to_string_pretty(&evaluation)?.as_bytes())?;
    Ok(evaluation)
}
