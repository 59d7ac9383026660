//! Experts: scripts that solve the tasks, as proof that scene, physics, phases and tools fit together.
//!
//! An expert sees the [`crate::Facts`], which no policy does; that is its only privilege. It acts through the same tool
//! calls as everybody, and each call is charged to the episode's budget.
//!
//! To add an expert: one file here, named as its task, and its line in `ALL`; what several use is in `skills`.

mod big_table;
mod cart_service;
mod co_carry;
mod co_pouring;
mod frame_hang;
mod handover;
mod move_house;
mod plus;
mod pouring;
pub(crate) mod skills;
mod table_align;
mod trash_collection;

use super::{PlayerError, PrivilegedEpisode, PrivilegedPlayer};
use crate::spec::EpisodeSpec;
use crate::tasks::{self, ObjectSpot, Task, TaskSet};
use skills::{Commander, Variety};

/// What tells the seed of guesses from the episode's own.
const GUESSES: u32 = 0x6775_6573;

/// Performs a task to its end.
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

/// The tasks of the benchmark that have an expert, in their order.
pub fn solved() -> impl Iterator<Item = &'static Task> {
    tasks::cohub().iter().copied().filter(|task| Expert::of(task).is_ok())
}

/// The script of one task.
pub struct Expert {
    task: &'static Task,
    script: ExpertScript,
    /// How its demonstration differs from the plain one, if it does.
    variety: Option<Variety>,
}

impl Expert {
    /// The expert of `task`; of a file that is called as one of the program's own tasks, if it has what that has.
    pub fn of(task: &'static Task) -> Result<Expert, PlayerError> {
        let known = ALL.iter().chain(plus::ALL);
        match known.clone().find(|(id, _)| *id == task.id && has_what_it_needs(task)) {
            Some((_, script)) => Ok(Expert { task, script: *script, variety: None }),
            None => {
                Err(PlayerError::NoExpert { task: task.id.into(), have: known.map(|(id, _)| *id).collect() })
            }
        }
    }
}

/// Whether there is an expert of `task`.
pub fn solves(task: &'static Task) -> bool {
    Expert::of(task).is_ok()
}

/// Whether the robots and objects that an expert asks for by name are those of the program's own task.
fn has_what_it_needs(task: &Task) -> bool {
    let Ok(own) = TaskSet::default().find(task.id) else { return false };
    let has = |spot: &ObjectSpot| {
        let same = |other: &ObjectSpot| other.name == spot.name && other.source() == spot.source();
        task.objects.iter().any(same)
    };
    task.robots.len() == own.robots.len() && own.objects.iter().all(has)
}

/// The task as robots that tell each other nothing take it to be: what the seed has chosen is guessed.
pub fn guessed(spec: &EpisodeSpec) -> &'static Task {
    spec.task.under(spec.world_seed() ^ GUESSES)
}

impl Expert {
    /// The expert of an episode, who demonstrates as its spec says.
    pub fn for_episode(spec: &EpisodeSpec) -> Result<Expert, PlayerError> {
        let variety = Variety::new(spec.variation.variety, spec.world_seed());
        Ok(Expert { variety, ..Expert::of(spec.task)? })
    }

    /// The same, where robots tell each other nothing: it takes another draw of the same choices for what the seed has chosen.
    pub fn without_words(spec: &EpisodeSpec) -> Result<Expert, PlayerError> {
        match spec.task.has_choices() {
            true => Ok(Expert { task: guessed(spec), ..Expert::for_episode(spec)? }),
            false => Err(PlayerError::NothingToSay { task: spec.task.id.into() }),
        }
    }
}

impl PrivilegedPlayer for Expert {
    fn play(&mut self, episode: &mut dyn PrivilegedEpisode) -> Result<(), PlayerError> {
        (self.script)(&mut Commander::new(self.task, episode)?.varied(self.variety.clone()))
    }
}
