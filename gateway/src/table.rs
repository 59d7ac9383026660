//! The episodes that are held, by id, and the limit on their number.

use std::{
    collections::BTreeMap,
    path::PathBuf,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering},
    },
};

use tandem_episodes::{Instructions, LocomotionChoice};
use tandem_tools_spec::{ResultReply, StartEpisode, StartReply, TaskList};
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

use crate::{episode_thread::EpisodeThread, problem::ApiError, run_folder};

/// The episodes of one server.
#[derive(Debug)]
pub struct EpisodeTable {
    episodes: Mutex<BTreeMap<String, Arc<EpisodeThread>>>,
    places: Arc<Semaphore>,
    limit: u32,
    closing: AtomicBool,
    runs: PathBuf,
    instructions: Instructions,
    locomotion: LocomotionChoice,
}

impl EpisodeTable {
    /// An empty table for at most `limit` episodes, recorded under `runs` and described by `instructions`, of robots that
    /// walk by `locomotion`.
    pub fn new(
        limit: u32,
        runs: PathBuf,
        instructions: Instructions,
        locomotion: LocomotionChoice,
    ) -> EpisodeTable {
        EpisodeTable {
            episodes: Mutex::default(),
            places: Arc::new(Semaphore::new(limit as usize)),
            limit,
            closing: AtomicBool::new(false),
            runs,
            instructions,
            locomotion,
        }
    }

    /// Starts an episode. Where every place is taken, an episode that has ended makes room.
    pub async fn start(&self, args: StartEpisode) -> Result<StartReply, ApiError> {
        let task = tandem_episodes::tasks::find(&args.task)?;
        let place = self.take_place().await?;
        let (id, folder) = run_folder::create(&self.runs, task.id, args.seed)
            .map_err(|error| ApiError::Internal(format!("no folder in {}: {error}", self.runs.display())))?;
        let (episode, mut briefing) =
            EpisodeThread::start(&id, args, self.locomotion.clone(), folder, place).await?;
        self.instructions.rephrase_briefing(&mut briefing);
        self.lock().insert(id.clone(), Arc::new(episode));
        tracing::info!(episode = id, "started");
        Ok(StartReply { episode_id: id, briefing })
    }

    /// The reply to `list_tasks`.
    pub fn task_list(&self) -> TaskList {
        self.instructions.task_list(&self.locomotion.limits())
    }

    /// The episode `id`.
    pub fn get(&self, id: &str) -> Result<Arc<EpisodeThread>, ApiError> {
        let episodes = self.lock();
        episodes.get(id).cloned().ok_or_else(|| unknown(id, &episodes))
    }

    /// Ends the episode `id`, forgets it and returns its result.
    pub async fn remove(&self, id: &str) -> Result<ResultReply, ApiError> {
        let episode = {
            let mut episodes = self.lock();
            episodes.remove(id).ok_or_else(|| unknown(id, &episodes))?
        };
        let result = episode.close().await?;
        tracing::info!(episode = id, "closed");
        Ok(result)
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
        let _ = self.places.acquire_many(self.limit).await;
    }

    async fn take_place(&self) -> Result<OwnedSemaphorePermit, ApiError> {
        if self.closing.load(Ordering::SeqCst) {
            return Err(ApiError::ShuttingDown);
        }
        if let Ok(place) = self.places.clone().try_acquire_owned() {
            return Ok(place);
        }
        if let Some(ended) = self.remove_one_that_has_ended() {
            ended.close().await?;
        }
        self.places.clone().try_acquire_owned().map_err(|_| ApiError::TooManyEpisodes { limit: self.limit })
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

fn unknown(id: &str, episodes: &BTreeMap<String, Arc<EpisodeThread>>) -> ApiError {
    ApiError::UnknownEpisode { id: id.into(), have: episodes.keys().cloned().collect() }
}
