//! Data that any thread needs to play an episode.

use std::sync::{Arc, Mutex};

use serde_json::Value;
use tandem_episodes::{EpisodeSpec, RunFolder};
use tokio::sync::OwnedSemaphorePermit;

use super::{onlookers::LiveFeed, status::SharedStatus};
use crate::{
    hosting::{
        HostingError,
        durable::{KeptAnswer, KeyedNote, LiveFolder},
    },
    metrics::Metrics,
};

/// Environment in which an episode is played.
#[derive(Debug)]
pub struct Surroundings {
    pub folder: RunFolder,
    /// Permit for one of the server's episodes, released when the episode is closed.
    pub place: OwnedSemaphorePermit,
    pub metrics: Arc<Metrics>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
}

/// State that a host keeps for an episode besides its world.
pub trait HostMemory: std::fmt::Debug + Send + Sync {
    /// Returns the part of the state that affects later answers.
    fn memory(&self) -> Value;

    /// Restores the memory that another process has written, and the answers and notes that may be requested
    /// again.
    fn restore(&self, memory: Option<Value>, answers: Vec<KeptAnswer>, notes: Vec<KeyedNote>);

    /// Drops the data that [`HostMemory::restore`] restores, because the episode is suspended.
    fn let_go(&self);

    /// Returns true if the episode must not be suspended, because a driver or a pending command needs it.
    fn is_busy(&self) -> bool;
}

/// Data that any thread needs to play the episode.
#[derive(Debug)]
pub struct Stage {
    pub id: String,
    pub spec: EpisodeSpec,
    pub folder: RunFolder,
    pub metrics: Arc<Metrics>,
    pub status: SharedStatus,
    pub feed: LiveFeed,
    /// Permit for one of the server's episodes; `None` once it is released.
    pub place: Mutex<Option<OwnedSemaphorePermit>>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
    /// Lock held by the thread that plays the episode, so that only one thread plays at a time.
    pub turn: Mutex<()>,
}

impl Stage {
    /// Creates the data of the episode `id`.
    pub fn new(id: &str, spec: EpisodeSpec, surroundings: Surroundings, status: SharedStatus) -> Stage {
        let Surroundings { folder, place, metrics, memory, journals } = surroundings;
        Stage {
            id: id.into(),
            spec,
            folder,
            metrics,
            status,
            feed: LiveFeed::new(),
            place: Mutex::new(Some(place)),
            memory,
            journals,
            turn: Mutex::default(),
        }
    }

    /// Removes the journal of a suspended episode, so that the episode cannot be restored.
    pub fn forget_journal(&self) -> Result<(), HostingError> {
        let Some(path) = self.journals.as_ref().and_then(|journals| journals.journal(&self.id)) else {
            return Ok(());
        };
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                Err(HostingError::Journal { path, source })
            }
            _ => Ok(()),
        }
    }
}
