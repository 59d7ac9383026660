//! Tasks as data: where robots and objects are, what varies with the seed, what is asked, and the phases
//! that score it. Every task is a TOML file: the benchmark's in `episodes/tasks/cohub`, our own in
//! `episodes/tasks/tandem_plus`, and those of users.
//!
//! To add a task to a suite: one file there and its line in `set`.

mod embedded;
mod file;
mod randomize;
mod set;
#[cfg(test)]
mod tests;

pub use embedded::TANDEM_PLUS;
pub use file::{TaskFileError, by_id_or_file, read_task, task_of};
pub use randomize::{Offset, Spread, StartPose};
pub(crate) use set::embedded_task;
pub use set::{TaskSet, built_in, cohub, find, in_order, tandem_plus};

use std::collections::BTreeMap;
use std::sync::{Arc, OnceLock};

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectFile, RobotModel, SimError, SplitMix64, Step};

use crate::conditions::{ConditionPart, OF_FINGERS, Truth};
use crate::scoring::{Phase, Scores};

/// What tells the numbers by which a seed chooses from those by which it moves things.
const CHOICES_STREAM: u64 = 0x6368_6f69_6365_7331;

/// A task, as its file has it.
#[derive(Debug)]
pub struct Task {
    pub id: &'static str,
    /// File name of the scene under `sim/assets/scenes`, or what messages call the scene that the file brings.
    pub scene: &'static str,
    /// The MJCF of the scene, where it is not one that the binary carries.
    pub scene_mjcf: Option<&'static str>,
    pub robots: &'static [RobotSpot],
    pub objects: &'static [ObjectSpot],
    /// What the seed moves, in the order in which it is drawn.
    pub randomize: &'static [Offset],
    /// What has to be done, for a policy that directs all robots.
    pub instruction: &'static str,
    /// Instruction for operators of one robot each, in place of the joint one, where that tells what not
    /// all of them may know.
    pub shared_instruction: Option<&'static str>,
    /// The task in other words, for each level of stress. `None` where the file has none.
    pub rewordings: Option<[TaskWords; 3]>,
    /// Control steps of an episode under the benchmark protocol.
    pub benchmark_steps: u32,
    /// Control steps of an episode under the agentic protocol.
    pub agentic_steps: u32,
    /// How long a policy may think under the agentic protocol.
    pub thinking_s: u32,
    /// p1, p2, ... in the order they have to be reached.
    pub phases: &'static [Phase],
    /// By phase, the expressions of its conditions.
    pub conditions: Vec<Vec<PhaseCondition>>,
    /// Whether the file says that hands have to close, whatever its conditions ask for.
    pub says_needs_fingers: bool,
    pub origin: TaskOrigin,
    pub source: TaskSource,
    /// Hash of the source, by which results tell files of one name apart.
    pub xxh3: String,
    /// What has been chosen in it. Empty where the seed has not been told yet.
    pub chosen: Vec<ChosenOption>,
    /// The same task for each way in which its choices fall out. Unset where it has no choices.
    pub variants: Arc<OnceLock<Vec<&'static Task>>>,
}

/// Where a task comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskOrigin {
    /// One of the benchmark's ten.
    Benchmark,
    /// A suite of our own.
    Suite(&'static str),
    /// A file that a user names, or one of the program's benches.
    File,
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
            shared: task.shared_instruction.map(str::to_owned),
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
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
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

impl Task {
    /// Begins to score an episode of this task with robots of this model, with the state before the first control step.
    pub fn scores(&self, robot: &Arc<RobotModel>, start: &Step) -> Result<Scores, SimError> {
        Scores::new(self.phases, self.objects.iter().map(|spot| (spot.name, spot.source())), robot, start)
    }

    /// Whether it is one of the benchmark's ten.
    pub fn is_benchmark(&self) -> bool {
        self.origin == TaskOrigin::Benchmark
    }

    /// Hash of its file, unless it is one of the benchmark's.
    pub fn file_xxh3(&self) -> Option<&str> {
        (!self.is_benchmark()).then_some(self.xxh3.as_str())
    }

    /// This task as the seed's choices make it. One that has nothing to choose is itself.
    pub fn under(&'static self, seed: u32) -> &'static Task {
        let Some(variants) = self.variants.get() else { return self };
        let drawn = SplitMix64(u64::from(seed) ^ CHOICES_STREAM).uniform([0.0, variants.len() as f32]);
        variants.get(drawn as usize).copied().unwrap_or(self)
    }

    /// Whether its file leaves something to the seed's choice.
    pub fn has_choices(&self) -> bool {
        self.variants.get().is_some()
    }

    /// The option that has been chosen, if the task has a choice of this name.
    pub fn chosen(&self, name: &str) -> Option<&str> {
        self.chosen.iter().find(|chosen| chosen.name == name).map(|chosen| chosen.option.as_str())
    }

    /// The suite of our own that it belongs to.
    pub fn suite(&self) -> Option<&'static str> {
        match self.origin {
            TaskOrigin::Suite(suite) => Some(suite),
            TaskOrigin::Benchmark | TaskOrigin::File => None,
        }
    }

    /// Whether its robots have to hold something with a thumb and fingers: its conditions ask for it, or
    /// its file says so.
    pub fn needs_fingers(&self) -> bool {
        self.says_needs_fingers || asks_for_fingers(&self.source.text)
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
