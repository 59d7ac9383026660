//! Restoration of episodes that belong to a server that has ended or to other servers on the same runs
//! folder.
//!
//! The episodes are found by their journals and stay suspended until a request needs them. This module also
//! suspends episodes that stay idle for long.

use std::{
    fs,
    path::Path,
    sync::{Arc, PoisonError},
    time::Duration,
};

use tandem_episodes::{EpisodeError, Recorder, RunFolder, build, partial_path, recover};
use tokio::task::spawn_blocking;

use super::{
    Caller, EpisodeTable, EpisodeThread, HostedEpisode, HostingError,
    durable::{JournalReader, Lease, Leasing, LiveFolder, StartKey},
    hosted_episode::Beside,
    table::unknown,
    team::{Team, TeamRules, seat_again},
};

/// Number of running episodes up to which no episode is suspended, however long it is idle. Each episode
/// takes some megabytes.
const MAX_AWAKE: usize = 96;

/// Number of executed control steps per second of idle time before an episode may be suspended. This idle
/// time is ten times as long as resuming the episode takes.
const STEPS_PER_IDLE_S: u32 = 300;

impl EpisodeTable {
    /// Begins to write journals to `journals`, and takes over the episodes of a server that has ended.
    pub fn keep_journals(&self, journals: LiveFolder) {
        let ids = journals.ids();
        if self.journals.set(journals).is_err() {
            return;
        }
        for id in ids {
            if self.is_elsewhere(&id) {
                continue;
            }
            match self.adopt(&id) {
                Ok(_) => tracing::info!(episode = id, "held, and brought back when it is asked for"),
                Err(error) => tracing::warn!(episode = id, %error, "not held"),
            }
        }
    }

    /// Returns true if another server plays the episode `id`.
    fn is_elsewhere(&self, id: &str) -> bool {
        let Some(journals) = self.journals.get() else { return false };
        journals.journal(id).is_some_and(|path| Lease::is_elsewhere(&path, &journals.url))
    }

    /// Returns the episode `id` after making sure that this server plays it.
    ///
    /// # Errors
    ///
    /// Returns an error if the episode is unknown, if another server plays it, or if it cannot be restored.
    pub async fn awake(self: &Arc<Self>, id: &str) -> Result<HostedEpisode, HostingError> {
        let hosted = match self.hosted(id) {
            Ok(hosted) => hosted,
            Err(unknown) if self.journals.get().is_none() => return Err(unknown),
            Err(_) => {
                let (table, id) = (self.clone(), id.to_owned());
                let adopted = spawn_blocking(move || table.adopt(&id));
                adopted.await.map_err(|_| HostingError::EpisodeStopped)??
            }
        };
        let there = hosted.thread.awake().await;
        if there.as_ref().is_err_and(HostingError::is_elsewhere) {
            self.forget(id);
        }
        there.map(|()| hosted)
    }

    /// Does the same as [`EpisodeTable::operator`], for the episodes of all servers on the runs folder.
    pub async fn operator_anywhere(self: &Arc<Self>, text: &str) -> Option<Caller> {
        if let Some(found) = self.operator(text) {
            return Some(found);
        }
        self.journals.get()?;
        let (table, text) = (self.clone(), text.to_owned());
        spawn_blocking(move || table.operator_elsewhere(&text)).await.ok()?
    }

    /// Finds the operator with the token `text` among the episodes that this server does not hold. The
    /// heading of a journal is read only once, not for every token tried. All tokens are compared.
    fn operator_elsewhere(&self, text: &str) -> Option<Caller> {
        let journals = self.journals.get()?;
        let ids = journals.ids();
        let mut others = self.others.lock().unwrap_or_else(PoisonError::into_inner);
        others.retain(|id, _| ids.contains(id));
        for id in ids {
            if !others.contains_key(&id)
                && self.hosted(&id).is_err()
                && let Some(team) = team_of(journals, &id)
            {
                others.insert(id, team);
            }
        }
        others.iter().fold(None, |found, (id, team)| {
            let robot = team.robot_of(text);
            robot.map(|robot| Caller::Operator { episode: id.clone(), robot: robot.into() }).or(found)
        })
    }

    /// Adds the episode `id`, which has a journal, to the table unless another server plays it.
    fn adopt(&self, id: &str) -> Result<HostedEpisode, HostingError> {
        let journals = self.journals.get().ok_or_else(|| unknown(id))?;
        let path = journals.journal(id).filter(|path| path.exists()).ok_or_else(|| unknown(id))?;
        let failed = |source| HostingError::Journal { path: path.clone(), source };
        let mut reader = JournalReader::open(&path).map_err(failed)?;
        let mut entries = Vec::new();
        while let Some(mut commit) = reader.next_commit().map_err(failed)? {
            entries.append(&mut commit.asked);
        }
        let heading = reader.heading;
        let folder = self.settings.run_folder(self.settings.runs.join(id), heading.visibility);
        if heading.build != build().map_err(EpisodeError::Build)? {
            tracing::warn!(
                episode = id,
                made_by = heading.build,
                "begun by another build, and not played here"
            );
            make_whole(&path, &folder, &journals.url);
        }
        let limit = self.settings.max_episodes;
        let place = self.places.clone().try_acquire_owned();
        let place = place.map_err(|_| HostingError::TooManyEpisodes { limit })?;
        let team = match heading.driving.is_per_robot() {
            true => Some(Team::of(&heading.start.operators, &heading.driving, TeamRules::of(&heading.spec))?),
            false => None,
        };
        let beside = Arc::new(Beside::new(team));
        let surroundings = self.surroundings(folder, place, beside.clone());
        let briefing = &heading.start.briefing;
        let thread = EpisodeThread::asleep(id, heading.spec, surroundings, briefing, entries.iter());
        let hosted = HostedEpisode::new(id, Arc::new(thread), beside);
        if let Some(StartKey { key, args }) = heading.key {
            self.starts.keep(key, (args, heading.driving), Ok(heading.start));
        }
        match self.hold(hosted.clone()) {
            // Another caller has added the episode meanwhile.
            Err(HostingError::HeldAlready { .. }) => self.hosted(id),
            held => held.map(|()| hosted),
        }
    }

    /// Ends abandoned episodes and suspends idle episodes. Also reconnects the partners that drove on the
    /// previous server. Call it periodically from within the async runtime.
    pub fn tidy_up(&self) {
        let episodes = self.all();
        for episode in &episodes {
            if let Some(team) = episode.team().filter(|team| team.misses_partners()).cloned() {
                let (thread, partner) = (episode.thread.clone(), self.partner());
                tokio::spawn(async move { seat_again(&team, &thread, partner).await });
            }
        }
        for episode in episodes.iter().filter(|episode| !episode.thread.ended()) {
            episode.thread.end_if_abandoned(self.settings.idle_timeout);
        }
        let mut awake: Vec<_> = episodes.iter().filter(|episode| episode.thread.may_sleep()).collect();
        let Some(too_many) = awake.len().checked_sub(MAX_AWAKE).filter(|count| *count > 0) else { return };
        awake.sort_by_key(|episode| std::cmp::Reverse(episode.thread.idle()));
        for episode in awake.into_iter().take(too_many) {
            let quiet_s = (episode.thread.env_steps() / STEPS_PER_IDLE_S).max(1);
            if episode.thread.idle() >= Duration::from_secs(quiet_s.into()) {
                episode.thread.put_aside();
            }
        }
    }

    /// Removes from the table the suspended episodes that other servers have taken over or ended. Call it
    /// every few seconds.
    pub fn look_around(&self) {
        let Some(journals) = self.journals.get() else { return };
        for episode in self.all() {
            if episode.thread.sleeps()
                && (self.is_elsewhere(episode.id())
                    || journals.journal(episode.id()).is_none_or(|path| !path.exists()))
            {
                self.forget(episode.id());
            }
        }
    }
}

/// Reads the operators of the episode `id` from its journal.
fn team_of(journals: &LiveFolder, id: &str) -> Option<Team> {
    let heading = JournalReader::open(&journals.journal(id)?).ok()?.heading;
    Team::of(&heading.start.operators, &heading.driving, TeamRules::default()).ok()
}

/// Makes an unfinished recording readable.
fn make_whole(journal: &Path, folder: &RunFolder, url: &str) {
    let partial = partial_path(&folder.path.join(Recorder::FILE_NAME));
    // The lease prevents other servers from doing the same at this time.
    let Ok(Leasing::Taken(_lease)) = Lease::take(journal, url) else { return };
    if fs::exists(&partial).unwrap_or(false)
        && let Err(error) = recover(&partial)
    {
        tracing::warn!(%error, "its recording is not whole");
    }
}
