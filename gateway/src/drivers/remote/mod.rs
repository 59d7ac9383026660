//! Learned policies as servers: we are their client. A map says which pictures and numbers they get under which key, and which they
//! give back.

mod action;
mod client;
mod columns;
mod error;
mod kept_client;
mod map;
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
    players::{
        EpisodeOutput, LocalEpisode, PlayError, PlayOutcome, PlayerError, Policy, PolicyWait, play_in_process,
    },
    results::PolicyCard,
    tasks::{Task, TaskWords},
};

use client::PolicyAddress;
pub use client::{PolicyKey, PolicyKeyError, PolicyProtocol};
pub use error::RemoteError;
pub use map::{MapError, PRESETS, PolicyMap, preset};
pub use trial::try_map;

use crate::hosting::PartnerPolicy;
use columns::EpisodeMoment;
use map::AnswerScope;
use policy_session::PolicySession;
use request::TaskInstructions;

/// A learned policy behind one socket, or one behind a socket for each robot.
#[derive(Debug)]
pub struct RemotePolicy {
    protocol: PolicyProtocol,
    /// One for all robots, or one for each in the task's order.
    servers: Vec<PolicyAddress>,
    map: PolicyMap,
    /// Since when each of the episodes that cannot begin yet has waited for the servers.
    waits: Mutex<Vec<Instant>>,
    /// How many episodes it has played whose seeds it is not told.
    untold: AtomicU32,
}

impl RemotePolicy {
    /// The policy at `urls`, asked as `map` says.
    pub fn new(protocol: PolicyProtocol, urls: Vec<String>, map: PolicyMap) -> RemotePolicy {
        let servers = urls.into_iter().map(|url| PolicyAddress { url, key: None }).collect();
        RemotePolicy { protocol, servers, map, waits: Mutex::default(), untold: AtomicU32::default() }
    }

    /// The same policy, whose servers want `key`. It is sent encrypted, and within this machine.
    pub fn with_key(mut self, key: Option<PolicyKey>) -> Result<RemotePolicy, PolicyKeyError> {
        for server in &mut self.servers {
            server.key = key.clone();
            self.protocol.check_key(server)?;
        }
        Ok(self)
    }

    /// The number by which the policy tells an episode from others: of its seed, or where it is told none, of how many it has played.
    fn number_of(&self, spec: &EpisodeSpec) -> u32 {
        let number = spec.told_seed().unwrap_or_else(|| self.untold.fetch_add(1, Ordering::Relaxed));
        EpisodeMoment::number_of(spec.task, number)
    }

    fn urls(&self) -> Vec<&str> {
        self.servers.iter().map(|server| server.url.as_str()).collect()
    }

    fn waits(&self) -> MutexGuard<'_, Vec<Instant>> {
        // Nothing panics while it holds the lock.
        self.waits.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    /// Connects to the servers for an episode of this task.
    fn open(&self, spec: &EpisodeSpec) -> Result<PolicySession<'_>, PlayError> {
        let began = Instant::now();
        self.waits().push(began);
        let session = {
            let (words, most_steps) =
                (instructions(spec.task, spec.task_words()), spec.rules().steps_per_command);
            PolicySession::open(self.protocol, &self.servers, &self.map, words, most_steps)
        };
        let mut waits = self.waits();
        let own = waits.iter().position(|wait| *wait == began);
        own.map(|index| waits.remove(index));
        drop(waits);
        session.map_err(|failures| self.not_opened(&failures))
    }

    /// Nothing was played. Where no server is there, there is none for any other episode.
    fn not_opened(&self, failures: &[RemoteError]) -> PlayError {
        let reasons: Vec<String> = failures.iter().map(RemoteError::to_string).collect();
        let reasons = reasons.join("; ");
        match failures.iter().find_map(|failure| failure.remedy(self.map.connect_s)) {
            Some(remedy) => PlayError::Absent(format!("{reasons}. {remedy}")),
            None => PlayError::NotReady(reasons),
        }
    }

    /// Whether there are as many servers as the task and the map want.
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
        self.check(spec.task).map_err(PlayError::NotReady)?;
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
        self.check(spec.task).map_err(PlayError::NotReady)?;
        let mut session = self.open(spec)?;
        connected();
        Ok(session.play(episode, self.number_of(spec)))
    }
}

fn instructions(task: &Task, words: TaskWords) -> TaskInstructions {
    TaskInstructions {
        task: task.id.into(),
        robots: task.robot_names().map(String::from).collect(),
        per_robot: words.robots,
        joint: words.joint,
    }
}
