//! The episodes that are held, by id, and the limit on their number.

use std::{
    collections::BTreeMap,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
};

use tandem_episodes::{EpisodeSpec, tasks};
use tandem_tools_spec::{Protocol, ResultReply, StartEpisode, StartReply, TaskList};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use super::{EpisodeThread, HostingError, run_folder};
use crate::settings::Settings;

/// The episodes of one server.
#[derive(Debug)]
pub struct EpisodeTable {
    episodes: Mutex<BTreeMap<String, Arc<EpisodeThread>>>,
    places: Arc<Semaphore>,
    closing: AtomicBool,
    settings: Arc<Settings>,
}

impl EpisodeTable {
    /// An empty table with as many places, words and robots as `settings` say.
    pub fn new(settings: Arc<Settings>) -> EpisodeTable {
        EpisodeTable {
            episodes: Mutex::default(),
            places: Arc::new(Semaphore::new(settings.max_episodes as usize)),
            closing: AtomicBool::new(false),
            settings,
        }
    }

    /// Starts an episode. Where every place is taken, an episode that has ended makes room.
    pub async fn start(&self, args: StartEpisode) -> Result<StartReply, HostingError> {
        let protocol = args.protocol.unwrap_or(Protocol::Agentic);
        let spec = EpisodeSpec {
            locomotion: self.settings.locomotion.clone(),
            disclosure: self.settings.disclosure,
            ..EpisodeSpec::new(tasks::find(&args.task)?, args.seed, protocol)
        };
        let place = self.take_place().await?;
        let runs = &self.settings.runs;
        let (id, folder) = run_folder::create(runs, spec.task.id, spec.seed)
            .map_err(|source| HostingError::Folder { runs: runs.clone(), source })?;
        let (episode, mut briefing) = EpisodeThread::start(&id, spec, folder, place).await?;
        self.settings.instructions.rephrase_briefing(&mut briefing);
        self.lock().insert(id.clone(), Arc::new(episode));
        tracing::info!(episode = id, "started");
        Ok(StartReply { episode_id: id, briefing })
    }

    /// The reply to `list_tasks`.
    pub fn task_list(&self) -> TaskList {
        self.settings.instructions.task_list(&self.settings.base_limits)
    }

    /// The episode `id`.
    pub fn get(&self, id: &str) -> Result<Arc<EpisodeThread>, HostingError> {
        let episodes = self.lock();
        episodes.get(id).cloned().ok_or_else(|| unknown(id, &episodes))
    }

    /// Ends the episode `id`, forgets it and returns its result.
    pub async fn remove(&self, id: &str) -> Result<ResultReply, HostingError> {
        let episode = {
            let mut episodes = self.lock();
            episodes.remove(id).ok_or_else(|| unknown(id, &episodes))?
        };
        let result = episode.close().await?;
        tracing::info!(episode = id, "closed");
        Ok(result.told(self.settings.disclosure))
    }

    /// How many episodes are held.
    pub fn len(&self) -> usize {
        self.lock().len()
    }

    /// Whether no episode is held.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Takes no more episodes, ends those that are held after the calls already waiting, and returns when every file is
    /// closed.
    pub async fn close_all(&self) {
        self.closing.store(true, Ordering::SeqCst);
        let episodes = std::mem::take(&mut *self.lock());
        for (id, episode) in episodes {
            match episode.close().await {
                Ok(_) => tracing::info!(episode = id, "closed"),
                Err(error) => tracing::error!(episode = id, %error, "not closed"),
            }
        }
        // Also waits for threads that no handle names any more, as after a client that left during its start.
        let _ = self.places.acquire_many(self.settings.max_episodes).await;
    }

    async fn take_place(&self) -> Result<OwnedSemaphorePermit, HostingError> {
        if self.closing.load(Ordering::SeqCst) {
            return Err(HostingError::ShuttingDown);
        }
        if let Ok(place) = self.places.clone().try_acquire_owned() {
            return Ok(place);
        }
        if let Some(ended) = self.remove_one_that_has_ended() {
            ended.close().await?;
        }
        let limit = self.settings.max_episodes;
        self.places.clone().try_acquire_owned().map_err(|_| HostingError::TooManyEpisodes { limit })
    }

    fn remove_one_that_has_ended(&self) -> Option<Arc<EpisodeThread>> {
        let mut episodes = self.lock();
        let id = episodes.iter().find(|(_, episode)| episode.ended()).map(|(id, _)| id.clone())?;
        episodes.remove(&id)
    }

    fn lock(&self) -> MutexGuard<'_, BTreeMap<String, Arc<EpisodeThread>>> {
        // Nothing panics while it holds the lock; were it so, the map itself would still be whole.
        self.episodes.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

fn unknown(id: &str, episodes: &BTreeMap<String, Arc<EpisodeThread>>) -> HostingError {
    HostingError::UnknownEpisode { id: id.into(), have: episodes.keys().cloned().collect() }
}
