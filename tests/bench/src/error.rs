//! Errors of benches.

use std::path::PathBuf;

use tandem_episodes::{EpisodeError, players::PlayerError};
use tandem_evaluation::batch::BatchError;
use tandem_ik::IkError;
use tandem_sim::SimError;

/// Reason for a failed measurement.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    #[error("cannot read the targets {path}: {source}")]
    Read { path: PathBuf, source: std::io::Error },
    #[error(transparent)]
    Ik(#[from] IkError),
    #[error(transparent)]
    Sim(#[from] SimError),
    #[error(transparent)]
    Episode(#[from] Box<EpisodeError>),
    #[error(transparent)]
    Batch(#[from] Box<BatchError>),
    #[error(transparent)]
    Player(#[from] PlayerError),
    #[error("no case's name contains `{asked}`; the cases are {have}")]
    NoCase { asked: String, have: String },
    #[error("0 episodes measure nothing; use at least 1")]
    NoEpisodes,
}
