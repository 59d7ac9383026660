//! Tasks as data: the poses of robots and objects, the randomisation, the instructions, and the phases
//! that score an episode. Every task is a TOML file: the benchmark's in `episodes/tasks/cohub`, our own
//! in `episodes/tasks/tandem_plus`, and those of users.
//!
//! To add a task to a suite, add its file to the folder and its name to the list in `embedded`.

mod embedded;
mod file;
mod randomize;
mod scene_file;
mod set;
mod task;
#[cfg(test)]
mod tests;

pub use embedded::TANDEM_PLUS;
pub use file::{TaskFileError, by_id_or_file, read_task, task_of};
pub use randomize::{Offset, Spread, StartPose};
pub use scene_file::SceneFile;
pub use set::embedded_task;
pub use set::{TaskSet, built_in, cohub, find, in_order, tandem_plus};
pub use task::Task;

use std::collections::BTreeMap;
use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tandem_sim::mjcf::Document;
use tandem_sim::{ObjectFile, ObjectModel, ObjectPart, Pose, RobotModel, Rotation, SimError, Step};

use crate::conditions::{ConditionPart, OF_FINGERS, Truth};
use crate::scoring::{Phase, Scores};

/// A task as its file defines it.
#[derive(Clone, Debug)]
pub struct TaskDefinition {
    pub id: String,
    /// File name of the scene under `sim/assets/scenes`, or the name that messages use for a scene from
    /// the task's own files.
    pub scene: String,
    /// Scene from the task's own files; `None` for an embedded one.
    pub scene_document: Option<Arc<Document>>,
    pub robots: Vec<RobotSpot>,
    pub objects: Vec<ObjectSpot>,
    /// Offsets drawn from the seed, in drawing order.
    pub randomize: Vec<Offset>,
    /// Instruction for a policy that directs all robots.
    pub instruction: String,
    /// Instruction for operators of one robot each. Set when the joint instruction contains information
    /// not meant for every robot.
    pub shared_instruction: Option<String>,
    /// Rewordings of the instructions, one for each stress level; `None` if the file has none.
    pub rewordings: Option<[TaskWords; 3]>,
    /// Control steps of an episode under the benchmark protocol.
    pub benchmark_steps: u32,
    /// Control steps of an episode under the agentic protocol.
    pub agentic_steps: u32,
    /// Limit of a policy's thinking time under the agentic protocol.
    pub thinking_s: u32,
    /// Phases p1, p2, ... in the order in which they must be reached.
    pub phases: Arc<[Phase]>,
    /// Conditions of each phase with their expressions.
    pub conditions: Vec<Vec<PhaseCondition>>,
    /// True if the file requires closing hands, even if no condition requires them.
    pub says_needs_fingers: bool,
    /// Grips that the brief explains; `None` for all grips.
    pub grips: Option<Vec<GripKind>>,
    pub origin: TaskOrigin,
    pub source: TaskSource,
    /// Hash of the source, which distinguishes files of the same name in results.
    pub xxh3: String,
    /// Options chosen by the seed; empty while no seed is set.
    pub chosen: Vec<ChosenOption>,
}

/// A grip that the brief can explain, by the object that it suits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GripKind {
    Bottle,
    Bar,
    Moulding,
    PlateEdge,
    Leg,
    Rim,
    WallRim,
}

/// Origin of a task.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TaskOrigin {
    /// One of the benchmark's ten tasks.
    Benchmark,
    /// One of our own suites, by name.
    Suite(&'static str),
    /// A file from a user, or one of the program's benches.
    File,
}

/// Instructions of a task for its policies.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TaskWords {
    /// Instruction for a policy that directs all robots.
    pub joint: String,
    /// Instruction for policies of one robot each, in place of `joint`; `None` unless `joint` contains
    /// information not meant for every robot.
    pub shared: Option<String>,
    /// Instructions for policies of one robot each, in the order of the robots.
    pub robots: Vec<String>,
}

impl TaskWords {
    /// Returns the instructions of the task's own wording.
    pub fn of(task: &TaskDefinition) -> TaskWords {
        TaskWords {
            joint: task.instruction.clone(),
            shared: task.shared_instruction.clone(),
            robots: task.robots.iter().map(|robot| robot.instruction.clone()).collect(),
        }
    }
}

/// A condition of a phase, as the task's file gives it.
#[derive(Clone, Debug)]
pub struct PhaseCondition {
    pub setting: PhaseSetting,
    /// Duration for which it must hold without interruption.
    pub for_s: f64,
    pub truth: Arc<Truth>,
    /// Parts that must all hold at once, each with its line and column in the file.
    pub parts: Vec<([usize; 2], ConditionPart)>,
}

/// Role of a condition in its phase: the name of its setting in the file.
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

/// An option chosen by the seed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ChosenOption {
    pub name: String,
    pub option: String,
}

/// The texts of a task, which fully define it.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct TaskSource {
    /// Name of the file, without its folder.
    pub name: String,
    pub text: String,
    /// MJCF files that the task names, by file name; they are in the same folder.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub beside: BTreeMap<String, String>,
    /// MJCF files that the task names and that name other files in turn, by file name.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub by_hash: BTreeMap<String, SceneFile>,
}

/// Start pose of a robot, and its instruction.
#[derive(Clone, Debug)]
pub struct RobotSpot {
    pub name: &'static str,
    pub position_m: [f32; 2],
    /// Yaw in the world frame; 0 faces along x.
    pub yaw_rad: f32,
    /// Instruction for a policy that directs this robot alone.
    pub instruction: String,
}

/// Nominal pose of an object, before randomisation.
#[derive(Clone, Debug)]
pub struct ObjectSpot {
    pub name: String,
    /// File name under `sim/assets/objects`, or the name that messages use for an MJCF from the task's
    /// own files.
    pub file: String,
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
    /// Orientation before the yaw; a body of a scene may lie or lean.
    pub turn: Rotation,
    pub source: ObjectFile,
}

/// Returns the name of an object, or of a part that moves on it, in texts for policies.
pub fn told_name(name: &str) -> String {
    name.replace('_', " ")
}

impl ObjectSpot {
    /// Returns the object's parts in a frame at the object's origin that follows the object's yaw, but no
    /// other rotation.
    pub fn parts(&self) -> Result<Vec<ObjectPart>, SimError> {
        let mut parts = ObjectModel::parts(&self.source, &self.name)?;
        if self.is_of_scene() {
            let turn = Pose::from_rotation(self.turn);
            for part in &mut parts {
                part.object_from_part = turn * part.object_from_part;
                part.object_from_moved_part = part.object_from_moved_part.map(|moved| turn * moved);
            }
        }
        Ok(parts)
    }

    /// Returns true for a body of the task's scene.
    pub fn is_of_scene(&self) -> bool {
        matches!(self.source, ObjectFile::OfScene { .. })
    }
}

impl TaskDefinition {
    /// Starts to score an episode of this task with robots of this model, from the state before the first
    /// control step.
    pub fn scores(&self, robot: &Arc<RobotModel>, start: &Step) -> Result<Scores, SimError> {
        let objects = self.objects.iter().map(|spot| (spot.name.as_str(), spot.source.clone()));
        Scores::new(self.phases.clone(), objects, robot, start)
    }

    /// Returns true for one of the benchmark's ten tasks.
    pub fn is_benchmark(&self) -> bool {
        self.origin == TaskOrigin::Benchmark
    }

    /// Returns the hash of the task's file; `None` for a benchmark task.
    pub fn file_xxh3(&self) -> Option<&str> {
        (!self.is_benchmark()).then_some(self.xxh3.as_str())
    }

    /// Returns the chosen option of the choice with this name.
    pub fn chosen(&self, name: &str) -> Option<&str> {
        self.chosen.iter().find(|chosen| chosen.name == name).map(|chosen| chosen.option.as_str())
    }

    /// Returns the name of the task's suite; `None` for benchmark tasks and files.
    pub fn suite(&self) -> Option<&'static str> {
        match self.origin {
            TaskOrigin::Suite(suite) => Some(suite),
            TaskOrigin::Benchmark | TaskOrigin::File => None,
        }
    }

    /// Returns true if the robots need a thumb and fingers to hold an object, because of a condition or the
    /// file's entry.
    pub fn needs_fingers(&self) -> bool {
        self.says_needs_fingers || asks_for_fingers(&self.source.text)
    }

    /// Returns the names of the robots, in order.
    pub fn robot_names(&self) -> impl Iterator<Item = &'static str> {
        self.robots.iter().map(|robot| robot.name)
    }
}

/// Returns true if an expression in a task file uses a function that only hands with fingers can satisfy.
/// Comments and instructions do not count.
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
