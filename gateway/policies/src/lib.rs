//! Learned policies that run on servers, of which Tandem is a client. A map assigns keys to the images and
//! values in requests and answers.

mod action;
mod client;
mod columns;
mod error;
mod kept_client;
mod map;
mod named_columns;
mod policy_session;
mod poses;
mod request;
mod trial;
mod values;

use std::{
    sync::{
        Mutex, MutexGuard,
        atomic::{AtomicU32, Ordering},
    },
    time::Instant,
};

use serde_json::json;
use tandem_episodes::{
    EpisodeSpec,
    players::{LocalEpisode, PlayerError},
    tasks::Task,
};
use tandem_evaluation::{
    policies::{EpisodeOutput, PartnerPolicy, PlayError, PlayOutcome, Policy, PolicyWait, play_in_process},
    results::PolicyCard,
};

use client::PolicyAddress;
pub use client::{PolicyKey, PolicyKeyError, PolicyProtocol};
pub use error::RemoteError;
pub use map::{MapError, PRESETS, PolicyMap, preset};
pub use trial::try_map;

use columns::EpisodeMoment;
use map::AnswerScope;
use policy_session::PolicySession;
use request::TaskInstructions;

/// A learned policy on one server, or on one server per robot.
#[derive(Debug)]
pub struct RemotePolicy {
    protocol: PolicyProtocol,
    /// One server for all robots, or one for each robot in the task's order.
    servers: Vec<PolicyAddress>,
    map: PolicyMap,
    /// Start times of connecting, for episodes that are not connected yet.
    waits: Mutex<Vec<Instant>>,
    /// Number of episodes played with a hidden seed.
    untold: AtomicU32,
}

impl RemotePolicy {
    /// Creates the policy at `urls`, with requests in the format of `map`.
    pub fn new(protocol: PolicyProtocol, urls: Vec<String>, map: PolicyMap) -> RemotePolicy {
        let servers = urls.into_iter().map(|url| PolicyAddress { url, key: None }).collect();
        RemotePolicy { protocol, servers, map, waits: Mutex::default(), untold: AtomicU32::default() }
    }

    /// Sets the key that the servers require. It may only be sent over encrypted or local connections.
    pub fn with_key(mut self, key: Option<PolicyKey>) -> Result<RemotePolicy, PolicyKeyError> {
        for server in &mut self.servers {
            server.key = key.clone();
            self.protocol.check_key(server)?;
        }
        Ok(self)
    }

    /// Returns the number that identifies an episode to the policy. It comes from the seed, or from a
    /// counter if the seed is hidden.
    fn number_of(&self, spec: &EpisodeSpec) -> u32 {
        let number = spec.told_seed().unwrap_or_else(|| self.untold.fetch_add(1, Ordering::Relaxed));
        EpisodeMoment::number_of(&spec.task, number)
    }

    fn urls(&self) -> Vec<&str> {
        self.servers.iter().map(|server| server.url.as_str()).collect()
    }

    fn waits(&self) -> MutexGuard<'_, Vec<Instant>> {
        // No thread panics while it holds the lock.
        self.waits.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Connects to the servers for an episode of `spec`.
    fn open(&self, spec: &EpisodeSpec) -> Result<PolicySession<'_>, PlayError> {
        let began = Instant::now();
        self.waits().push(began);
        let session = {
            let words = TaskInstructions::of(&spec.task, spec.task_words());
            let most_steps = spec.rules().steps_per_command;
            PolicySession::open(self.protocol, &self.servers, &self.map, words, most_steps)
        };
        let mut waits = self.waits();
        let own = waits.iter().position(|wait| *wait == began);
        own.map(|index| waits.remove(index));
        drop(waits);
        session.map_err(|failures| self.not_opened(&failures))
    }

    /// Returns the error for an episode that was not played. A missing server also affects all other
    /// episodes.
    fn not_opened(&self, failures: &[RemoteError]) -> PlayError {
        let reasons: Vec<String> = failures.iter().map(RemoteError::to_string).collect();
        let reasons = reasons.join("; ");
        match failures.iter().find_map(|failure| failure.remedy(self.map.connect_s)) {
            Some(remedy) => PlayError::Absent(format!("{reasons}. {remedy}")),
            None => PlayError::NotReady(reasons),
        }
    }

    /// Checks that the number of servers is valid for the task and the map.
    fn check(&self, task: &Task) -> Result<(), String> {
        let (servers, robots) = (self.servers.len(), task.robots.len());
        match (servers, self.map.answer) {
            (1, _) => Ok(()),
            (_, AnswerScope::All) => {
                Err(format!("{servers} servers, and one answer moves all robots; give one"))
            }
            (_, AnswerScope::One) if servers == robots => Ok(()),
            (_, AnswerScope::One) => {
                Err(format!("{servers} servers for {robots} robots; give one for all, or one for each"))
            }
        }
    }
}

impl Policy for RemotePolicy {
    fn card(&self) -> PolicyCard {
        PolicyCard {
            name: format!("{}:{}", self.protocol, self.urls().join(",")),
            settings: Some(json!(self.map)),
            extra_information: self.map.extra_information(),
        }
    }

    fn play_episode(&self, spec: &EpisodeSpec, place: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.check(&spec.task).map_err(PlayError::NotReady)?;
        let mut session = self.open(spec)?;
        Ok(play_in_process(spec, place, |episode| session.play(episode, self.number_of(spec)))?)
    }

    fn waiting(&self) -> Option<PolicyWait> {
        let lasted = self.waits().iter().min()?.elapsed();
        Some(PolicyWait { target: self.urls().join(", "), lasted })
    }
}

impl PartnerPolicy for RemotePolicy {
    fn name(&self) -> String {
        self.card().name
    }

    fn play(
        &self,
        spec: &EpisodeSpec,
        episode: &mut dyn LocalEpisode,
        connected: &mut dyn FnMut(),
    ) -> Result<Result<(), PlayerError>, PlayError> {
        self.check(&spec.task).map_err(PlayError::NotReady)?;
        let mut session = self.open(spec)?;
        connected();
        Ok(session.play(episode, self.number_of(spec)))
    }
}
