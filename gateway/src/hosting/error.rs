//! Why the host of episodes refuses.

use std::{io, path::PathBuf};

use tandem_episodes::EpisodeError;

/// Refusals of the host, and those of the episode that it passes on.
#[derive(Debug, thiserror::Error)]
pub enum HostingError {
    /// The episode refused.
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    /// No such episode. Which there are is their callers' business.
    #[error("no episode {id:?}")]
    UnknownEpisode {
        /// What was asked for.
        id: String,
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
    /// The episode was closed meanwhile.
    #[error("the episode has stopped")]
    EpisodeStopped,
    /// The episode's thread panicked.
    #[error(
        "the simulator failed in this episode and the episode ends here; its recording holds what went before"
    )]
    EpisodePanicked,
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
