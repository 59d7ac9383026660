//! Experts: scripts that solve the tasks, as proof that scene, physics, phases and tools fit together.
//!
//! An expert sees the [`crate::Facts`], which no policy does; that is its only privilege. It acts through
//! the same tool calls as any other player, and each call is charged to the episode's budget.
//!
//! To add an expert: one file here with the task's name, and its line in `ALL`. Shared code is in `skills`.

mod big_table;
mod cart_service;
mod co_carry;
mod co_pouring;
mod frame_hang;
mod handover;
mod move_house;
mod plus;
mod pouring;
pub mod skills;
mod table_align;
mod trash_collection;

use super::{PlayerError, PrivilegedEpisode, PrivilegedPlayer};
use crate::spec::EpisodeSpec;
use crate::tasks::{ObjectSpot, Task, TaskSet};
use skills::{Commander, Variety};

/// Constant that separates the seed of guesses from the episode's own.
const GUESSES: u32 = 0x6775_6573;

/// Script that performs a task to its end.
type ExpertScript = fn(&mut Commander) -> Result<(), PlayerError>;

const ALL: &[(&str, ExpertScript)] = &[
    ("handover", handover::perform),
    ("pouring", pouring::perform),
    ("frame_hang", frame_hang::perform),
    ("co_pouring", co_pouring::perform),
    ("trash_collection", trash_collection::perform),
    ("cart_service", cart_service::perform),
    ("co_carry", co_carry::perform),
    ("table_align", table_align::perform),
    ("move_house", move_house::perform),
    ("big_table", big_table::perform),
];

/// The script of one task.
pub struct Expert {
    task: Task,
    script: ExpertScript,
    /// Variation of the demonstration; `None` for the plain one.
    variety: Option<Variety>,
}

impl Expert {
    /// Returns the expert of `task`. A task from a file gets the expert of the built-in task with the same
    /// id if it has the same robots and objects.
    ///
    /// # Errors
    ///
    /// If no expert knows the task.
    pub fn of(task: &Task) -> Result<Expert, PlayerError> {
        let known = ALL.iter().chain(plus::ALL);
        match known.clone().find(|(id, _)| *id == task.id && has_what_it_needs(task)) {
            Some((_, script)) => Ok(Expert { task: task.clone(), script: *script, variety: None }),
            None => {
                Err(PlayerError::NoExpert { task: task.id.clone(), have: known.map(|(id, _)| *id).collect() })
            }
        }
    }
}

/// Returns `true` if there is an expert of `task`.
pub fn solves(task: &Task) -> bool {
    Expert::of(task).is_ok()
}

/// Returns `true` if `task` has the robots and objects of the built-in task with its id, which its expert
/// asks for by name.
fn has_what_it_needs(task: &Task) -> bool {
    let set = TaskSet::default();
    let Ok(own) = set.find(&task.id) else { return false };
    let has = |spot: &ObjectSpot| {
        let same = |other: &ObjectSpot| other.name == spot.name && other.source == spot.source;
        task.objects.iter().any(same)
    };
    task.robots.len() == own.robots.len() && own.objects.iter().all(has)
}

/// Returns the task with a guess in place of the seed's choices, for robots that do not communicate.
pub fn guessed(spec: &EpisodeSpec) -> Task {
    spec.task.under(spec.world_seed() ^ GUESSES)
}

impl Expert {
    /// Returns the expert of an episode, with the variety that its spec asks for.
    pub fn for_episode(spec: &EpisodeSpec) -> Result<Expert, PlayerError> {
        let variety = Variety::new(spec.variation.variety, spec.world_seed());
        Ok(Expert { variety, ..Expert::of(&spec.task)? })
    }

    /// Returns the expert of an episode whose robots do not communicate: another draw replaces the seed's
    /// choices.
    ///
    /// # Errors
    ///
    /// If the task has no expert, or the seed chooses nothing in it.
    pub fn without_words(spec: &EpisodeSpec) -> Result<Expert, PlayerError> {
        match spec.task.has_choices() {
            true => Ok(Expert { task: guessed(spec), ..Expert::for_episode(spec)? }),
            false => Err(PlayerError::NothingToSay { task: spec.task.id.clone() }),
        }
    }
}

impl PrivilegedPlayer for Expert {
    fn play(&mut self, episode: &mut dyn PrivilegedEpisode) -> Result<(), PlayerError> {
        (self.script)(&mut Commander::new(&self.task, episode)?.varied(self.variety.clone()))
    }
}
