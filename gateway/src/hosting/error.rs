//! Why the host of episodes refuses.

use std::{io, path::PathBuf};

use tandem_episodes::EpisodeError;

/// Refusals of the host, and those of the episode that it passes on.
#[derive(Debug, thiserror::Error)]
pub enum HostingError {
    /// The episode refused.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// No such episode.
    #[error("no episode {id:?}; have: {}", list(.have))]
    UnknownEpisode {
        /// What was asked for.
        id: String,
        /// The episodes that are held.
        have: Vec<String>,
    },
    /// Every place for an episode is taken.
    #[error("all {limit} places for episodes are taken")]
    TooManyEpisodes {
        /// How many places there are.
        limit: u32,
    },
    /// Too many calls wait for one episode.
    #[error("{limit} calls already wait for this episode; call again when one of them has answered")]
    TooManyWaiting {
        /// How many may wait.
        limit: usize,
    },
    /// The server is going down.
    #[error("the server is shutting down and takes no new episodes; try again when it is back")]
    ShuttingDown,
    /// The episode's thread is gone without having been asked to.
    #[error("the episode has stopped")]
    EpisodeStopped,
    /// The episode has no folder to be recorded into.
    #[error("no folder in {}: {source}", .runs.display())]
    Folder {
        /// Where it was to be made.
        runs: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// The system gives no thread for the world.
    #[error("no thread for an episode: {0}")]
    Thread(#[source] io::Error),
}

fn list(names: &[String]) -> String {
    if names.is_empty() { "none".into() } else { names.join(", ") }
}
