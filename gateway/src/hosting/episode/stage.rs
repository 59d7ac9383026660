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
    /// One of the server's places for episodes, released when the episode is closed.
    pub place: OwnedSemaphorePermit,
    pub metrics: Arc<Metrics>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
}

/// State that a host keeps of an episode besides its world.
pub trait HostMemory: std::fmt::Debug + Send + Sync {
    /// Returns the part of it that affects later answers.
    fn memory(&self) -> Value;

    /// Restores the memory of another process, and the answers and notes that may be requested again.
    fn restore(&self, memory: Option<Value>, answers: Vec<KeptAnswer>, notes: Vec<KeyedNote>);

    /// Drops the data that [`HostMemory::restore`] brings back, because the episode is suspended.
    fn let_go(&self);

    /// Returns true if a player in this process would miss the episode.
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
    /// Place that the episode takes among the server's episodes.
    pub place: Mutex<Option<OwnedSemaphorePermit>>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
    /// Held by the thread that plays; one does at a time.
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

    /// Removes the journal of a suspended episode, which will not be brought back.
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
