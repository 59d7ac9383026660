//! Learned policies as servers: we are their client. A map says which pictures and numbers they get under which key, and which they
//! give back.

mod answer;
mod columns;
mod error;
mod link;
mod map;
mod mind;
mod picture;
mod request;
mod sight;
mod values;

use serde_json::json;
use tandem_episodes::{
    EpisodeSpec,
    players::{EpisodeOutput, PlayError, PlayOutcome, Policy, play_in_process},
    results::PolicyCard,
    rules,
    tasks::Task,
};

pub use link::Protocol;
pub use map::{MapError, PRESETS, PolicyMap};

use map::Answer;
use mind::Mind;
use request::Cast;

/// A learned policy behind one socket, or one behind a socket for each robot.
#[derive(Debug)]
pub struct Remote {
    protocol: Protocol,
    /// One for all robots, or one for each in the task's order.
    urls: Vec<String>,
    map: PolicyMap,
}

impl Remote {
    /// The policy at `urls`, asked as `map` says.
    pub fn new(protocol: Protocol, urls: Vec<String>, map: PolicyMap) -> Remote {
        Remote { protocol, urls, map }
    }

    /// Whether there are as many servers as the task and the map want.
    fn check(&self, task: &Task) -> Result<(), String> {
        let (servers, robots) = (self.urls.len(), task.robots.len());
        match (servers, self.map.answer) {
            (1, _) => Ok(()),
            (_, Answer::All) => Err(format!("{servers} servers, and one answer moves all robots; give one")),
            (_, Answer::One) if servers == robots => Ok(()),
            (_, Answer::One) => {
                Err(format!("{servers} servers for {robots} robots; give one for all, or one for each"))
            }
        }
    }
}

impl Policy for Remote {
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
        let mind = Mind::open(self.protocol, &self.urls, &self.map, cast(spec.task), most_steps);
        let mut mind = mind.map_err(|error| PlayError::NotReady(error.to_string()))?;
        Ok(play_in_process(spec, place, |episode| mind.play(episode))?)
    }
}

fn cast(task: &Task) -> Cast {
    let robots = task.robots.iter();
    Cast {
        names: robots.clone().map(|robot| robot.name.into()).collect(),
        instructions: robots.map(|robot| robot.instruction.into()).collect(),
        joint_instruction: task.instruction.into(),
    }
}
