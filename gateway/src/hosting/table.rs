//! The table of a server's episodes by id, with the limit on their number.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    fs,
    sync::{Arc, Mutex, MutexGuard, OnceLock},
    time::Duration,
};

use tandem_episodes::{EpisodeError, EpisodeSpec, RunFolder, build};
use tandem_evaluation::policies::PartnerPolicy;
use tandem_tools_spec::{
    Assistance, Briefing, Driving, EpisodeList, ResultReply, StartEpisode, StartReply, TaskList,
};
use tokio::{
    sync::{OwnedSemaphorePermit, Semaphore},
    task::JoinSet,
    time::{Instant, timeout_at},
};

use super::{
    Caller, EpisodeThread, HostedEpisode, HostingError,
    durable::{Heading, LiveFolder, StartKey},
    episode::Surroundings,
    hosted_episode::Beside,
    idempotency_cache::{IdempotencyCache, IdempotentReply},
    run_folder::{RunFolders, episode_name},
    team::{Collection, OperatorHandle, Team, TeamRules},
};
use crate::{metrics::Metrics, settings::Settings};

/// The episodes of one server.
#[derive(Debug)]
pub struct EpisodeTable {
    held: Mutex<HeldEpisodes>,
    pub(super) places: Arc<Semaphore>,
    pub(super) settings: Arc<Settings>,
    pub(super) starts: IdempotencyCache<(StartEpisode, Driving), SharedStart>,
    pub(super) metrics: Arc<Metrics>,
    folders: RunFolders,
    purpose: Purpose,
    /// Folder of the journals, set if episodes outlive the server.
    pub(super) journals: OnceLock<LiveFolder>,
    /// Operators of episodes that this server does not hold, by episode id.
    pub(super) others: Mutex<BTreeMap<String, Team>>,
    partner: Option<Arc<dyn PartnerPolicy>>,
}

/// Purpose of a server, and the policy that can drive a robot beside people.
#[derive(Debug, Default)]
pub struct Guests {
    /// Purpose of the server.
    pub purpose: Purpose,
    /// Policy that drives a robot at a person's request; pages cannot choose another policy.
    pub partner: Option<Arc<dyn PartnerPolicy>>,
}

/// Purpose of a server. It determines who may start episodes and who may drive the robots.
#[derive(Debug, Clone, Default)]
pub enum Purpose {
    /// Clients start episodes and choose the drivers.
    #[default]
    Clients,
    /// An evaluation in this process starts episodes and scores them. Clients play these episodes, but cannot
    /// start episodes or request other drivers.
    Evaluation,
    /// People play the episodes that a collection in this process starts.
    Collection(Arc<Collection>),
}

/// Outcome of a start, shared by its callers.
type SharedStart = Result<StartReply, Arc<HostingError>>;

#[derive(Debug, Default)]
struct HeldEpisodes {
    episodes: BTreeMap<String, HostedEpisode>,
    /// True while the server shuts down; no episode is added any more.
    closing: bool,
}

impl EpisodeTable {
    /// Creates an empty table with the episode limit and the other settings in `settings`.
    pub fn new(settings: Arc<Settings>) -> EpisodeTable {
        EpisodeTable {
            held: Mutex::default(),
            places: Arc::new(Semaphore::new(settings.max_episodes as usize)),
            settings,
            starts: IdempotencyCache::default(),
            metrics: Arc::default(),
            folders: RunFolders::default(),
            purpose: Purpose::default(),
            journals: OnceLock::new(),
            others: Mutex::default(),
            partner: None,
        }
    }

    /// Creates an empty table for the purpose and the policy in `guests`.
    pub fn for_guests(settings: Arc<Settings>, guests: Guests) -> EpisodeTable {
        let Guests { purpose, partner } = guests;
        EpisodeTable { purpose, partner, ..EpisodeTable::new(settings) }
    }

    /// Returns the policy that can drive a robot beside people.
    ///
    /// # Errors
    ///
    /// Returns [`HostingError::NoPolicy`] if the server was started without one.
    pub fn partner(&self) -> Result<Arc<dyn PartnerPolicy>, HostingError> {
        let reason = "no policy may drive here; start the server with --partner, for example act:http://127.0.0.1:8500/act";
        self.partner.clone().ok_or_else(|| HostingError::NoPolicy { reason: reason.into() })
    }

    /// Returns true if the episodes belong to an evaluation in this process.
    pub fn is_evaluation(&self) -> bool {
        matches!(self.purpose, Purpose::Evaluation)
    }

    /// Returns true if clients start episodes on this server and may resume them.
    pub fn serves_clients(&self) -> bool {
        matches!(self.purpose, Purpose::Clients)
    }

    /// Returns the collection that this server is for, if any.
    pub fn collection(&self) -> Option<&Collection> {
        match &self.purpose {
            Purpose::Collection(collection) => Some(collection),
            Purpose::Clients | Purpose::Evaluation => None,
        }
    }

    /// Returns an error if this server is for an evaluation, in which clients start no episodes.
    fn check_starts(&self) -> Result<(), HostingError> {
        match self.purpose {
            Purpose::Evaluation => Err(HostingError::OneEpisode),
            Purpose::Clients | Purpose::Collection(_) => Ok(()),
        }
    }

    /// Returns the metrics.
    pub fn metrics(&self) -> &Arc<Metrics> {
        &self.metrics
    }

    /// Does the same as [`EpisodeTable::start_driven`], but only once for each idempotency key.
    pub async fn start_once(
        self: &Arc<Self>,
        args: StartEpisode,
        driving: Driving,
        key: &str,
    ) -> Result<IdempotentReply<StartReply>, HostingError> {
        let (table, request) = (self.clone(), (args.clone(), driving));
        let own_key = Some(key.to_owned());
        let work = async move { table.start_with_key(args, driving, own_key).await.map_err(Arc::new) };
        let lasting = |made: &SharedStart| made.as_ref().map_or_else(|error| error.is_final(), |_| true);
        let IdempotentReply { reply, replayed } = self.starts.once(key, request, work, lasting).await?;
        Ok(IdempotentReply { reply: reply.map_err(HostingError::Shared)?, replayed })
    }

    /// Starts an episode in which one policy controls all robots.
    pub async fn start(&self, args: StartEpisode) -> Result<StartReply, HostingError> {
        self.start_driven(args, Driving::default()).await
    }

    /// Starts an episode. If the episode limit is reached, an ended episode is removed first.
    pub async fn start_driven(
        &self,
        args: StartEpisode,
        driving: Driving,
    ) -> Result<StartReply, HostingError> {
        self.start_with_key(args, driving, None).await
    }

    async fn start_with_key(
        &self,
        args: StartEpisode,
        driving: Driving,
        key: Option<String>,
    ) -> Result<StartReply, HostingError> {
        self.check_starts()?;
        let (spec, is_short) = (self.settings.spec(&args)?, args.short);
        let key = key.map(|key| StartKey { key, args });
        let reply = self.start_kept(spec, &driving, key).await?;
        let briefing = if is_short { reply.briefing.shortened() } else { reply.briefing };
        Ok(StartReply { briefing, ..reply })
    }

    /// Starts an episode whose specification differs from the server's settings.
    pub async fn start_spec(&self, spec: EpisodeSpec, driving: &Driving) -> Result<StartReply, HostingError> {
        self.check_starts()?;
        self.start_kept(spec, driving, None).await
    }

    /// Starts an episode that a restarted server can resume. `key` is the idempotency key of the start.
    async fn start_kept(
        &self,
        spec: EpisodeSpec,
        driving: &Driving,
        key: Option<StartKey>,
    ) -> Result<StartReply, HostingError> {
        let place = self.take_place().await?;
        let (id, path) = self.folders.create(&self.settings.runs, &episode_name(&spec)?);
        let folder = self.settings.run_folder(path, self.settings.record);
        let (episode, start) = self.begin(&id, spec, driving, folder, place).await?;
        if self.journals.get().is_some() {
            let build = build().map_err(EpisodeError::Build)?;
            let spec = episode.spec().clone();
            let heading = Heading::new(build, spec, self.settings.record, driving, start.clone(), key);
            episode.begin_journal(heading).await?;
            if self.settings.advertised_url.is_some() {
                // The server that receives the first request for the episode plays it.
                episode.put_aside();
            }
        }
        Ok(start)
    }

    /// Starts `spec` under the name `id` with its files in `folder`, for an evaluation in this process.
    pub async fn host(
        &self,
        id: &str,
        spec: EpisodeSpec,
        driving: &Driving,
        folder: RunFolder,
    ) -> Result<StartReply, HostingError> {
        let place = self.take_place().await?;
        Ok(self.begin(id, spec, driving, folder, place).await?.1)
    }

    async fn begin(
        &self,
        id: &str,
        spec: EpisodeSpec,
        driving: &Driving,
        folder: RunFolder,
        place: OwnedSemaphorePermit,
    ) -> Result<(Arc<EpisodeThread>, StartReply), HostingError> {
        let spec = EpisodeSpec { operators: driving.operators.unwrap_or_default(), ..spec };
        let (team, operators) = match driving.is_per_robot() {
            true => Team::new(spec.task.robot_names(), driving, self.collection(), TeamRules::of(&spec))
                .map(|(team, tokens)| (Some(team), tokens))?,
            false => (None, Vec::new()),
        };
        let beside = Arc::new(Beside::new(team));
        let surroundings = self.surroundings(folder, place, beside.clone());
        let (episode, briefing) = EpisodeThread::start(id, spec, surroundings).await?;
        let episode = Arc::new(episode);
        if let Err(refused) = self.hold(HostedEpisode::new(id, episode.clone(), beside)) {
            episode.close().await?;
            return Err(refused);
        }
        tracing::info!(episode = id, "started");
        let idle_limit_s = self.settings.idle_timeout.as_secs();
        Ok((episode, StartReply { episode_id: id.into(), idle_limit_s, operators, briefing }))
    }

    /// Returns the environment in which an episode is played on this server.
    pub(super) fn surroundings(
        &self,
        folder: RunFolder,
        place: OwnedSemaphorePermit,
        memory: Arc<Beside>,
    ) -> Surroundings {
        let journals = self.journals.get().cloned();
        Surroundings { folder, place, metrics: self.metrics.clone(), memory, journals }
    }

    /// Returns the reply to `list_tasks`, with this server's limit on thinking time and without information
    /// that is hidden from its policies.
    pub fn task_list(&self) -> TaskList {
        let Settings { tasks, stress, base_limits, instructions, .. } = &*self.settings;
        let mut list = instructions.task_list(tasks, *stress, base_limits);
        if let Some(limit_s) = self.settings.thinking_limit_s {
            let protocols = list.tasks.iter_mut().flat_map(|task| &mut task.protocols);
            protocols.for_each(|info| info.wall_clock_s = Some(limit_s.into()));
        }
        match self.settings.assistance {
            // In the paper, the scored phases are not part of a task's description.
            Assistance::Paper => list.tasks.iter_mut().for_each(|task| task.phases.clear()),
            Assistance::Full => {}
        }
        list
    }

    /// Returns the thread of the episode `id`.
    pub fn get(&self, id: &str) -> Result<Arc<EpisodeThread>, HostingError> {
        self.hosted(id).map(|hosted| hosted.thread)
    }

    /// Returns the episode `id`.
    pub fn hosted(&self, id: &str) -> Result<HostedEpisode, HostingError> {
        self.lock().episodes.get(id).cloned().ok_or_else(|| unknown(id))
    }

    /// Returns the handle of the operator `caller`. Restores its episode if necessary.
    pub async fn own_robot(self: &Arc<Self>, caller: &Caller) -> Result<OperatorHandle, HostingError> {
        let Caller::Operator { episode, robot } = caller else { return Err(HostingError::NeedsOperator) };
        let hosted = self.awake(episode).await?;
        hosted.team().ok_or(HostingError::NeedsOperator)?;
        hosted.operator(robot)
    }

    /// Checks that `who` may replace operators by the expert or a policy of this process. Only the host's
    /// client may do so.
    pub fn check_stand_in(&self, who: &Caller) -> Result<(), HostingError> {
        match (&self.purpose, who) {
            (Purpose::Evaluation, _) => Err(HostingError::OneEpisode),
            (Purpose::Collection(_), _) => Err(HostingError::PeopleDrive),
            (Purpose::Clients, Caller::Operator { .. }) => Err(HostingError::HostsBusiness),
            (Purpose::Clients, Caller::Host) => Ok(()),
        }
    }

    /// Returns the episode `id`, whose robots have operators. Restores the episode if necessary.
    pub async fn with_operators(self: &Arc<Self>, id: &str) -> Result<HostedEpisode, HostingError> {
        let hosted = self.awake(id).await?;
        hosted.team().ok_or(HostingError::OnePolicy)?;
        Ok(hosted)
    }

    /// Returns the briefing of the episode `id` for `who`, with this server's instructions.
    pub async fn briefing(&self, id: &str, who: &Caller) -> Result<Briefing, HostingError> {
        self.hosted(id)?.briefing(who).await
    }

    /// Lists the episodes to which `who` has access, by id.
    pub fn list(&self, who: &Caller) -> EpisodeList {
        let held = self.lock();
        let known = held.episodes.values().filter(|episode| episode.admit(who).is_ok());
        EpisodeList { episodes: known.map(HostedEpisode::told_entry).collect() }
    }

    /// Lists all episodes for watchers.
    pub fn watched(&self) -> EpisodeList {
        EpisodeList { episodes: self.lock().episodes.values().map(HostedEpisode::entry).collect() }
    }

    /// Lists the ids of the suspended episodes. Rendering an image would resume them.
    pub fn asleep(&self) -> Vec<String> {
        let held = self.lock();
        let asleep = held.episodes.values().filter(|episode| episode.thread.sleeps());
        asleep.map(|episode| episode.id().to_owned()).collect()
    }

    /// Returns true if `who` is an operator that may send messages to other operators.
    pub fn may_talk(&self, who: &Caller) -> bool {
        match who {
            Caller::Operator { episode, .. } => self.hosted(episode).is_ok_and(|hosted| hosted.may_talk()),
            Caller::Host => false,
        }
    }

    /// Returns the operator with the token `text`. Compares every token of every episode.
    ///
    /// Between two episodes, the people of a collection count as operators of an episode with an empty id.
    pub fn operator(&self, text: &str) -> Option<Caller> {
        let seat = self.collection().and_then(|collection| collection.robot_of(text));
        let seat = seat.map(|robot| Caller::Operator { episode: String::new(), robot: robot.into() });
        let held = self.lock();
        held.episodes.iter().fold(seat, |found, (id, hosted)| {
            let robot = hosted.team().and_then(|team| team.robot_of(text));
            robot.map(|robot| Caller::Operator { episode: id.clone(), robot: robot.into() }).or(found)
        })
    }

    /// Ends the episode `id`, removes it from the table and returns its result.
    pub async fn remove(&self, id: &str) -> Result<ResultReply, HostingError> {
        let episode = self.lock().episodes.remove(id).ok_or_else(|| unknown(id))?;
        let result = match episode.close().await {
            // This build cannot resume the episode, so only its recording remains.
            Err(error) if error.is_of_other_build() => {
                let journal = self.journals.get().and_then(|journals| journals.journal(id));
                if let Some(Err(error)) = journal.map(fs::remove_file) {
                    tracing::error!(episode = id, %error, "the journal stays");
                }
                return Err(HostingError::EpisodeStopped);
            }
            result => result?,
        };
        tracing::info!(episode = id, "closed");
        Ok(result.disclosed(self.settings.disclosure))
    }

    /// Removes the episode `id`, which another server has taken over, from the table.
    pub(super) fn forget(&self, id: &str) {
        self.lock().episodes.remove(id);
    }

    /// Returns all episodes that are held.
    pub(super) fn all(&self) -> Vec<HostedEpisode> {
        self.lock().episodes.values().cloned().collect()
    }

    /// Returns the number of episodes that are held.
    pub fn len(&self) -> usize {
        self.lock().episodes.len()
    }

    /// Returns true if no episode is held.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the number of episodes that have not ended.
    pub fn running(&self) -> usize {
        self.lock().episodes.values().filter(|episode| !episode.thread.ended()).count()
    }

    /// Accepts no more episodes, ends all episodes after the calls already waiting, and closes every file.
    ///
    /// Returns when all episodes are closed or after `limit`, with the names of the episodes that were not
    /// closed by then. If `keep` is true, episodes can be resumed later; suspended episodes always can.
    pub async fn close_all(&self, limit: Duration, keep: bool) -> Vec<String> {
        let deadline = Instant::now() + limit;
        let episodes = {
            let mut held = self.lock();
            held.closing = true;
            std::mem::take(&mut held.episodes)
        };
        let mut closings = JoinSet::new();
        for (id, episode) in episodes.into_iter().filter(|(_, episode)| !episode.thread.sleeps()) {
            closings.spawn(async move {
                match timeout_at(deadline, episode.close_for(keep)).await {
                    Ok(Ok(_)) => tracing::info!(episode = id, "closed"),
                    Ok(Err(error)) => tracing::error!(episode = id, %error, "not closed"),
                    Err(_) => return Some(format!("{id} in {}", episode.thread.folder().display())),
                }
                None
            });
        }
        let mut left: Vec<String> = closings.join_all().await.into_iter().flatten().collect();
        // Waits for episodes that are starting, too, including those whose client has disconnected.
        let places = self.settings.max_episodes;
        if timeout_at(deadline, self.places.acquire_many(places)).await.is_err() {
            let starting = (places as usize).saturating_sub(self.places.available_permits() + left.len());
            left.extend((starting > 0).then(|| format!("{starting} that had not begun")));
        }
        left
    }

    /// Adds an episode that one policy controls.
    #[cfg(test)]
    pub(crate) fn insert(&self, id: &str, episode: Arc<EpisodeThread>) -> Result<(), HostingError> {
        self.hold(HostedEpisode::new(id, episode, Arc::default()))
    }

    /// Adds an episode. Returns an error if the table is closing or already holds an episode with that id.
    pub(super) fn hold(&self, episode: HostedEpisode) -> Result<(), HostingError> {
        let mut held = self.lock();
        if held.closing {
            return Err(HostingError::ShuttingDown);
        }
        match held.episodes.entry(episode.id().into()) {
            Entry::Vacant(free) => drop(free.insert(episode)),
            Entry::Occupied(taken) => return Err(HostingError::HeldAlready { id: taken.key().clone() }),
        }
        Ok(())
    }

    async fn take_place(&self) -> Result<OwnedSemaphorePermit, HostingError> {
        if self.lock().closing {
            return Err(HostingError::ShuttingDown);
        }
        if let Ok(place) = self.places.clone().try_acquire_owned() {
            return Ok(place);
        }
        if let Some(ended) = self.remove_one_that_has_ended() {
            // The result of the ended episode is not for this caller.
            let _ = ended.end_for_good().await;
        }
        let limit = self.settings.max_episodes;
        self.places.clone().try_acquire_owned().map_err(|_| HostingError::TooManyEpisodes { limit })
    }

    fn remove_one_that_has_ended(&self) -> Option<Arc<EpisodeThread>> {
        let episodes = &mut self.lock().episodes;
        let ended = episodes.iter().find(|(_, episode)| episode.thread.ended());
        let id = ended.map(|(id, _)| id.clone())?;
        episodes.remove(&id).map(|hosted| hosted.thread)
    }

    fn lock(&self) -> MutexGuard<'_, HeldEpisodes> {
        // Nothing panics while it holds the lock. Even after a panic, the map would be intact.
        self.held.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

pub(super) fn unknown(id: &str) -> HostingError {
    HostingError::UnknownEpisode { id: id.into() }
}
