//! Players that act in an episode by tool calls. A player that solves a task through knowledge that only
//! the simulator has is a [`PrivilegedPlayer`]; no other type receives that knowledge.
//!
//! To add a player: one file or folder here and its line in [`ALL`].

mod demonstration;
pub mod experts;
mod idle;
mod in_process;

use tandem_tools_spec::{ExtraInformation, Observe, ToolCall, ToolReply};

use crate::observation::{Picture, TeamObservation};
use crate::scoring::Facts;
use crate::spec::EpisodeSpec;
use crate::tasks::Task;

pub use demonstration::recorded_action;
pub use in_process::InProcess;

/// One episode, in this process or behind HTTP, as a player acts on it: by tool calls.
pub trait Episode {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError>;
}

/// An episode that also shows facts that no policy sees.
pub trait PrivilegedEpisode: Episode {
    fn facts(&mut self) -> Result<Facts, PlayerError>;
}

/// An episode in the caller's own process, which shows images as rendered.
pub trait LocalEpisode: Episode {
    /// Returns the image, depth and readings that a call of `observe` shows, rendered and complete. `shown`
    /// is the information shown to the policy that the benchmark withholds from its policies.
    fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, PlayerError>;

    /// Executes a call that a policy decided on. Nothing is withheld from the reply, which the policy
    /// itself does not see.
    fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError>;

    /// Returns an image of the room from a third-person view. A policy that sees it has extra information,
    /// and its results record that.
    fn third_person(&mut self) -> Result<Picture, PlayerError>;
}

/// A player that plays one episode to its end by tool calls alone; created anew for each episode.
pub trait Player {
    fn play(&mut self, episode: &mut dyn Episode) -> Result<(), PlayerError>;
}

/// A player that plays one episode to its end with knowledge of the facts; created anew for each episode.
pub trait PrivilegedPlayer {
    fn play(&mut self, episode: &mut dyn PrivilegedEpisode) -> Result<(), PlayerError>;
}

/// Reason why a player stopped before the episode's end.
#[derive(Debug, thiserror::Error)]
pub enum PlayerError {
    #[error("no player {name:?}; have: {}", .have.join(", "))]
    UnknownPlayer { name: String, have: Vec<&'static str> },
    #[error("no expert for task {task:?}; have: {}", .have.join(", "))]
    NoExpert { task: String, have: Vec<&'static str> },
    #[error(
        "the seed chooses nothing in task {task:?}, so its robots have nothing to tell each other; play it \
         with expert"
    )]
    NothingToSay { task: String },
    #[error("the episode has ended")]
    EpisodeOver,
    #[error("{tool} failed: {reason}")]
    Call { tool: &'static str, reason: String },
    #[error("{0}")]
    GaveUp(String),
    /// The policy itself failed, for example because its server is gone: its further actions are unknown.
    #[error("{0}")]
    Failed(String),
}

/// A player by name.
#[derive(Debug)]
pub struct PlayerEntry {
    pub name: &'static str,
    pub about: &'static str,
    make: PlayerFactory,
}

/// Constructor of a player for an episode.
#[derive(Debug)]
enum PlayerFactory {
    Player(fn(&EpisodeSpec) -> Result<Box<dyn Player>, PlayerError>),
    PrivilegedPlayer(fn(&EpisodeSpec) -> Result<Box<dyn PrivilegedPlayer>, PlayerError>),
}

/// Every player.
pub static ALL: &[PlayerEntry] = &[
    PlayerEntry {
        name: "expert",
        about: "the task's scripted expert, which sees object poses",
        make: PlayerFactory::PrivilegedPlayer(|spec| Ok(Box::new(experts::Expert::for_episode(spec)?))),
    },
    PlayerEntry {
        name: "no_words",
        about: "the expert of a task in which the seed chooses something, whose robots do not tell each other what: it is guessed",
        make: PlayerFactory::PrivilegedPlayer(|spec| Ok(Box::new(experts::Expert::without_words(spec)?))),
    },
    PlayerEntry {
        name: "idle",
        about: "nobody: robots hold still until the steps of the benchmark protocol are used up",
        make: PlayerFactory::Player(|spec| Ok(Box::new(idle::Idle::new(&spec.task)))),
    },
    PlayerEntry {
        name: "demonstration",
        about: "what the robots were told in the recording that the episode starts from, told again",
        make: PlayerFactory::Player(|spec| Ok(Box::new(demonstration::Demonstration::new(spec)))),
    },
];

/// Returns the player called `name`.
///
/// # Errors
///
/// If there is none; the error lists the players.
pub fn find(name: &str) -> Result<&'static PlayerEntry, PlayerError> {
    ALL.iter().find(|entry| entry.name == name).ok_or_else(|| PlayerError::UnknownPlayer {
        name: name.into(),
        have: ALL.iter().map(|entry| entry.name).collect(),
    })
}

/// Returns the player for a task without another policy: its expert, or the idle player if it has none.
pub fn expert_or_nobody(task: &Task) -> Result<&'static PlayerEntry, PlayerError> {
    find(if experts::solves(task) { "expert" } else { "idle" })
}

impl PlayerEntry {
    /// Checks that the player can play such an episode.
    ///
    /// # Errors
    ///
    /// Returns the reason if it cannot.
    pub fn check(&self, spec: &EpisodeSpec) -> Result<(), PlayerError> {
        match self.make {
            PlayerFactory::Player(make) => make(spec).map(drop),
            PlayerFactory::PrivilegedPlayer(make) => make(spec).map(drop),
        }
    }

    /// Plays the episode `spec`. An episode that ends under way is no error: the last phase may have been
    /// reached.
    pub fn play(&self, spec: &EpisodeSpec, episode: &mut dyn PrivilegedEpisode) -> Result<(), PlayerError> {
        let outcome = match self.make {
            PlayerFactory::Player(make) => make(spec)?.play(episode),
            PlayerFactory::PrivilegedPlayer(make) => make(spec)?.play(episode),
        };
        match outcome {
            Err(PlayerError::EpisodeOver) => Ok(()),
            outcome => outcome,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks;
    use tandem_tools_spec::Protocol;

    #[test]
    fn every_player_can_be_made_for_every_task_or_says_for_which() {
        for entry in ALL {
            assert_eq!(find(entry.name).unwrap().name, entry.name);
            for task in tasks::cohub() {
                let spec = EpisodeSpec::new(task, 0, Protocol::Agentic);
                let solved = experts::solves(task);
                match entry.check(&spec) {
                    // None of the benchmark's tasks has choices.
                    Err(PlayerError::NothingToSay { .. }) if entry.name == "no_words" => {}
                    Ok(()) => assert!(solved || entry.name != "expert", "{} for {}", entry.name, task.id),
                    Err(error) => {
                        let text = error.to_string();
                        assert!(!solved && text.starts_with("no expert for task"), "{text}");
                        assert!(text.contains(&task.id) && text.contains("have: handover"), "{text}");
                    }
                }
            }
        }
        let text = find("expart").unwrap_err().to_string();
        assert_eq!(text, "no player \"expart\"; have: expert, no_words, idle, demonstration");
    }
}
