//! Tasks as data: where things stand, what varies with the seed, what is asked, and the phases that score it.
//!
//! To add a task: one file here and its line in [`ALL`].

mod big_table;
mod cart_service;
mod co_carry;
mod co_pouring;
mod frame_hang;
mod handover;
mod move_house;
mod pouring;
mod randomize;
mod table_align;
mod trash_collection;

pub use randomize::{Offset, Spread, StartPose, uniform_xy};

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectFile, RobotModel, SimError, SplitMix64, Step};

use crate::EpisodeError;
use crate::conditions::{ConditionPart, OF_FINGERS, Truth};
use crate::scoring::{Phase, Scores};

/// Every task, in the benchmark's order.
pub static ALL: &[Task] = &[
    handover::TASK,
    pouring::TASK,
    frame_hang::TASK,
    co_pouring::TASK,
    trash_collection::TASK,
    cart_service::TASK,
    co_carry::TASK,
    table_align::TASK,
    move_house::TASK,
    big_table::TASK,
];

/// What tells the numbers by which a seed chooses from those by which it moves things.
const CHOICES_STREAM: u64 = 0x6368_6f69_6365_7331;

/// A task: one of the benchmark's, or one that somebody has written into a file.
#[derive(Debug)]
pub struct Task {
    pub id: &'static str,
    /// File name of the scene under `sim/assets/scenes`, or what messages call the scene that the task's file brings.
    pub scene: &'static str,
    pub robots: &'static [RobotSpot],
    pub objects: &'static [ObjectSpot],
    /// What the seed moves, in the order in which it is drawn.
    pub randomize: &'static [Offset],
    /// What has to be done, for a policy that directs all robots.
    pub instruction: &'static str,
    /// Control steps of an episode under the benchmark protocol.
    pub benchmark_steps: u32,
    /// p1, p2, ... in the order they have to be reached.
    pub phases: &'static [Phase],
    /// The file that it was read from; the benchmark's are none.
    pub file: Option<TaskFile>,
}

/// The budget of the benchmark's tasks under the agentic protocol, which a task's file may change: control steps, and how long the
/// policy may think.
pub const AGENTIC_STEPS: u32 = 6000;
pub const THINKING_S: u32 = 1800;

/// What a task has that was read from a file, and none of the benchmark's.
#[derive(Debug)]
pub struct TaskFile {
    pub source: TaskSource,
    /// Hash of the source, by which results tell files of one name apart.
    pub xxh3: String,
    /// The MJCF of the scene, where it is not one that the binary carries.
    pub scene_mjcf: Option<&'static str>,
    /// Control steps of an episode under the agentic protocol.
    pub agentic_steps: u32,
    /// How long a policy may think in it.
    pub thinking_s: u32,
    /// What operators of one robot each read in place of the joint instruction, where that tells what not all of them may know.
    pub shared_instruction: Option<&'static str>,
    /// The task in other words, for each level of stress; nothing where the file has none.
    pub rewordings: Option<[TaskWords; 3]>,
    /// Whether it says that hands have to close, whatever its conditions ask for.
    pub needs_fingers: bool,
    /// By phase, what its conditions are made of.
    pub conditions: Vec<Vec<PhaseCondition>>,
    /// The suite of the program's own to which the file belongs.
    pub suite: Option<&'static str>,
    /// What has been chosen in it; nothing where the seed has not been told yet.
    pub chosen: Vec<ChosenOption>,
    /// The same task for each way in which its choices fall out; none where it has no choices.
    pub variants: Arc<OnceLock<Vec<&'static Task>>>,
}

/// What policies are told to do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskWords {
    /// For a policy that directs all robots.
    pub joint: String,
    /// What those who direct one robot each read in its place, where it tells what not all of them may know.
    pub shared: Option<String>,
    /// For policies that direct one each, in the order of the robots.
    pub robots: Vec<String>,
}

impl TaskWords {
    /// The task's own.
    pub fn of(task: &Task) -> TaskWords {
        TaskWords {
            joint: task.instruction.into(),
            shared: task.shared_instruction().map(str::to_owned),
            robots: task.robots.iter().map(|robot| robot.instruction.into()).collect(),
        }
    }
}

/// A condition of a phase, as its task's file has it.
#[derive(Clone, Debug)]
pub struct PhaseCondition {
    pub setting: PhaseSetting,
    /// How long it has to hold without a break.
    pub for_s: f64,
    pub truth: Arc<Truth>,
    /// What has to hold at once for it to hold, each with its line and column in the file.
    pub parts: Vec<([usize; 2], ConditionPart)>,
}

/// What a condition is to its phase: the setting of the file that it stands in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PhaseSetting {
    Done,
    First,
    Then,
    Broken,
    Lasting,
    AtEnd,
    Milestone,
    Spoiled,
}

impl PhaseSetting {
    pub fn name(self) -> &'static str {
        match self {
            PhaseSetting::Done => "done",
            PhaseSetting::First => "first",
            PhaseSetting::Then => "then",
            PhaseSetting::Broken => "broken",
            PhaseSetting::Lasting => "lasting",
            PhaseSetting::AtEnd => "at_end",
            PhaseSetting::Milestone => "milestone",
            PhaseSetting::Spoiled => "spoiled",
        }
    }
}

/// What a choice of a task's file has come to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChosenOption {
    pub name: String,
    pub option: String,
}

/// The texts that a task was read from: it is made of nothing else, so that whoever has them has the task.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskSource {
    /// Name of the file, without its folder.
    pub name: String,
    pub text: String,
    /// MJCF files that it names, which lie beside it.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub beside: BTreeMap<String, String>,
}

/// Where a robot stands, and its part of the task.
#[derive(Debug)]
pub struct RobotSpot {
    pub name: &'static str,
    pub position_m: [f32; 2],
    /// Which way it faces; 0 is along world x.
    pub yaw_rad: f32,
    /// What has to be done, for a policy that directs this robot alone.
    pub instruction: &'static str,
}

/// Where an object rests before the seed moves it.
#[derive(Debug)]
pub struct ObjectSpot {
    pub name: &'static str,
    /// File name under `sim/assets/objects`, or what messages call the MJCF that the task's file brings.
    pub file: &'static str,
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
    /// The object's MJCF, where it is not one that the binary carries.
    pub mjcf: Option<&'static str>,
}

impl ObjectSpot {
    /// What the object is made of.
    pub fn source(&self) -> ObjectFile {
        match self.mjcf {
            None => ObjectFile::Embedded(self.file.into()),
            Some(mjcf) => ObjectFile::Text { name: self.file.into(), mjcf: mjcf.into() },
        }
    }
}

/// An object called as its file, not turned.
pub const fn spot(name: &'static str, position_m: [f32; 3]) -> ObjectSpot {
    ObjectSpot { name, file: name, position_m, yaw_rad: 0.0, mjcf: None }
}

impl Task {
    /// Begins to score an episode of this task with robots of this model, with the state before the first control step.
    pub fn scores(&self, robot: &Arc<RobotModel>, start: &Step) -> Result<Scores, SimError> {
        Scores::new(self.phases, self.objects.iter().map(|spot| (spot.name, spot.source())), robot, start)
    }

    /// Hash of the file that it was read from.
    pub fn file_xxh3(&self) -> Option<&str> {
        self.file.as_ref().map(|file| file.xxh3.as_str())
    }

    /// This task as the seed's choices make it. One that has nothing to choose is itself.
    pub fn under(&'static self, seed: u32) -> &'static Task {
        let variants = self.file.as_ref().and_then(|file| file.variants.get());
        let Some(variants) = variants else { return self };
        let drawn = SplitMix64(u64::from(seed) ^ CHOICES_STREAM).uniform([0.0, variants.len() as f32]);
        variants.get(drawn as usize).copied().unwrap_or(self)
    }

    /// Whether its file leaves something to the seed's choice.
    pub fn has_choices(&self) -> bool {
        self.file.as_ref().is_some_and(|file| file.variants.get().is_some())
    }

    /// The option that has been chosen, if the task has a choice of this name.
    pub fn chosen(&self, name: &str) -> Option<&str> {
        let chosen = &self.file.as_ref()?.chosen;
        chosen.iter().find(|chosen| chosen.name == name).map(|chosen| chosen.option.as_str())
    }

    /// The suite that it belongs to, if it is none of the benchmark's.
    pub fn suite(&self) -> Option<&'static str> {
        self.file.as_ref()?.suite
    }

    /// What operators of one robot each read in place of the joint instruction, where that tells what not all of them may know.
    pub fn shared_instruction(&self) -> Option<&'static str> {
        self.file.as_ref()?.shared_instruction
    }

    /// Names of the robots, in their order.
    pub fn robot_names(&self) -> impl Iterator<Item = &'static str> {
        self.robots.iter().map(|robot| robot.name)
    }
}

/// The benchmark has one task of each id; a file may have another.
impl PartialEq for Task {
    fn eq(&self, other: &Task) -> bool {
        self.id == other.id && self.file_xxh3() == other.file_xxh3()
    }
}

/// The tasks that there are to play: the benchmark's, those of the program's own suites, and those of files.
#[derive(Clone, Debug, Default)]
pub struct TaskSet {
    of_suites: Vec<&'static Task>,
    of_files: Vec<&'static Task>,
}

impl TaskSet {
    /// The benchmark's tasks, those of suites, and those of files, of which one that is called as one of the others takes its place.
    pub fn with(of_suites: Vec<&'static Task>, of_files: Vec<&'static Task>) -> TaskSet {
        TaskSet { of_suites, of_files }
    }

    /// The first task that a file brings.
    pub fn first_of_files(&self) -> Option<&'static Task> {
        self.of_files.first().copied()
    }

    /// The benchmark's order, then that of the suites, then that of the files.
    pub fn all(&self) -> impl Iterator<Item = &'static Task> {
        let replaced = |task: &&'static Task| self.of_files.iter().all(|other| other.id != task.id);
        let built_in = ALL.iter().chain(self.of_suites.iter().copied());
        built_in.filter(replaced).chain(self.of_files.iter().copied())
    }

    /// The task called `id`.
    pub fn find(&self, id: &str) -> Result<&'static Task, EpisodeError> {
        self.all().find(|task| task.id == id).ok_or_else(|| {
            let have = self.all().map(|task| task.id).collect();
            EpisodeError::UnknownTask { id: id.into(), have }
        })
    }
}

impl Task {
    /// Whether its robots have to hold something with a thumb and fingers: those of the benchmark do, and those of files whose conditions
    /// ask for it, or that say so.
    pub fn needs_fingers(&self) -> bool {
        self.file.as_ref().is_none_or(|file| file.needs_fingers || asks_for_fingers(&file.source.text))
    }
}

/// Whether an expression in a task's file asks for what only fingers do. Comments and instructions are none.
fn asks_for_fingers(file: &str) -> bool {
    fn asks(value: &toml::Value) -> bool {
        match value {
            toml::Value::String(text) => OF_FINGERS.iter().any(|name| text.contains(&format!("{name}("))),
            toml::Value::Array(values) => values.iter().any(asks),
            toml::Value::Table(values) => values.values().any(asks),
            _ => false,
        }
    }
    let table: toml::Table = file.parse().unwrap_or_default();
    ["terms", "phases"].iter().filter_map(|part| table.get(*part)).any(asks)
}

/// The tasks of these, each once: the benchmark's in its order, then those of files as they come.
pub fn in_order(played: impl Iterator<Item = &'static Task> + Clone) -> Vec<&'static Task> {
    let mut found: Vec<&'static Task> =
        ALL.iter().filter(|task| played.clone().any(|one| one == *task)).collect();
    for task in played {
        if !found.contains(&task) {
            found.push(task);
        }
    }
    found
}

/// The benchmark's task called `id`.
pub fn find(id: &str) -> Result<&'static Task, EpisodeError> {
    TaskSet::default().find(id)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_task_is_complete() {
        for task in ALL {
            assert!(find(task.id).is_ok_and(|found| found.id == task.id));
            let names: Vec<&str> = task.robots.iter().map(|robot| robot.name).collect();
            assert_eq!(names, &["A", "B", "C"][..names.len()], "{}", task.id);
            assert_eq!(task.phases.len(), 3, "{}", task.id);
            for offset in task.randomize {
                let known = |name: &&str| task.objects.iter().any(|spot| spot.name == *name);
                assert!(offset.objects.iter().all(known), "{} moves {:?}", task.id, offset.objects);
            }
        }
    }

    #[test]
    fn an_unknown_task_lists_those_there_are() {
        let text = find("handove").unwrap_err().to_string();
        assert!(text.starts_with("no task \"handove\"; have: handover"), "{text}");
    }
}
