//! Learned policies as servers: we are their client. A map says which pictures and numbers they get under which key, and which they
//! give back.

mod action_rows;
mod client;
mod columns;
mod error;
mod map;
mod picture;
mod policy_session;
mod request;
mod values;

use serde_json::json;
use tandem_episodes::{
    EpisodeSpec,
    players::{EpisodeOutput, PlayError, PlayOutcome, Policy, play_in_process},
    results::PolicyCard,
    rules,
    tasks::Task,
};

pub use client::PolicyProtocol;
pub use map::{MapError, PRESETS, PolicyMap};

use map::AnswerScope;
use policy_session::PolicySession;
use request::TaskInstructions;

/// A learned policy behind one socket, or one behind a socket for each robot.
#[derive(Debug)]
pub struct RemotePolicy {
    protocol: PolicyProtocol,
    /// One for all robots, or one for each in the task's order.
    urls: Vec<String>,
    map: PolicyMap,
}

impl RemotePolicy {
    /// The policy at `urls`, asked as `map` says.
    pub fn new(protocol: PolicyProtocol, urls: Vec<String>, map: PolicyMap) -> RemotePolicy {
        RemotePolicy { protocol, urls, map }
    }

    /// Whether there are as many servers as the task and the map want.
    fn check(&self, task: &Task) -> Result<(), String> {
        let (servers, robots) = (self.urls.len(), task.robots.len());
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
            name: format!("{}:{}", self.protocol, self.urls.join(",")),
            settings: Some(json!(self.map)),
            extra_information: self.map.extra_information(),
        }
    }

    fn play_episode(&self, spec: &EpisodeSpec, place: EpisodeOutput) -> Result<PlayOutcome, PlayError> {
        self.check(spec.task).map_err(PlayError::NotReady)?;
        let most_steps = rules(spec.protocol, spec.task).steps_per_command;
        let session =
            PolicySession::open(self.protocol, &self.urls, &self.map, instructions(spec.task), most_steps);
        let mut session = session.map_err(|error| PlayError::NotReady(error.to_string()))?;
        Ok(play_in_process(spec, place, |episode| session.play(episode))?)
    }
}

fn instructions(task: &Task) -> TaskInstructions {
    let robots = task.robots.iter();
    TaskInstructions {
        robots: robots.clone().map(|robot| robot.name.into()).collect(),
        per_robot: robots.map(|robot| robot.instruction.into()).collect(),
        joint: task.instruction.into(),
    }
}
