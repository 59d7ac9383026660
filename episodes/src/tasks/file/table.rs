//! A task file as parsed from TOML, before any name in it is resolved. Spans give the position of a value
//! in the file.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

use crate::tasks::GripKind;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskTable {
    pub id: Spanned<String>,
    /// Name of an embedded scene, or of an MJCF file beside this one.
    pub scene: Option<Spanned<String>>,
    /// Inline MJCF of the scene.
    pub scene_mjcf: Option<Spanned<String>>,
    pub instruction: Spanned<String>,
    /// Instruction for operators of one robot each. Used in place of `instruction` when that contains
    /// information not meant for every robot.
    pub shared_instruction: Option<Spanned<String>>,
    /// Rewordings for stress levels 1, 2 and 3.
    pub rewordings: Option<Spanned<Vec<RewordingTable>>>,
    /// True for a task that needs closing hands even if no condition requires them.
    #[serde(default)]
    pub needs_fingers: bool,
    /// Grips that the brief explains; all grips if it is not given.
    pub grips: Option<Vec<GripKind>>,
    #[serde(default)]
    pub budget: BudgetTable,
    /// Choices made by the seed; each `{name}` in the file's texts is replaced by an option.
    #[serde(default)]
    pub choices: Vec<ChoiceTable>,
    pub robots: Spanned<Vec<RobotTable>>,
    #[serde(default)]
    pub objects: Vec<ObjectTable>,
    #[serde(default)]
    pub randomize: Vec<OffsetTable>,
    /// Named expressions. Each may refer to earlier ones.
    #[serde(default)]
    pub terms: BTreeMap<Spanned<String>, Spanned<String>>,
    pub phases: Spanned<Vec<PhaseTable>>,
}

#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct BudgetTable {
    pub benchmark_steps: Option<Spanned<u32>>,
    pub agentic_steps: Option<Spanned<u32>>,
    pub thinking_s: Option<Spanned<u32>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ChoiceTable {
    pub name: Spanned<String>,
    pub options: Spanned<Vec<Spanned<String>>>,
}

/// Texts that replace the instructions of the same names.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RewordingTable {
    pub instruction: Spanned<String>,
    pub shared_instruction: Option<Spanned<String>>,
    pub robots: BTreeMap<String, Spanned<String>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RobotTable {
    pub name: Spanned<String>,
    pub position_m: Spanned<[f64; 2]>,
    #[serde(default)]
    pub yaw_deg: Option<Spanned<f64>>,
    pub instruction: Spanned<String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectTable {
    pub name: Spanned<String>,
    /// Name of an embedded object, or of an MJCF file beside this one; by default the object's name.
    pub file: Option<Spanned<String>>,
    /// Inline MJCF of the object.
    pub mjcf: Option<Spanned<String>>,
    /// True for a body of the scene, which has the object's name and is where the scene puts it.
    #[serde(default)]
    pub in_scene: bool,
    pub position_m: Option<Spanned<[f64; 3]>>,
    #[serde(default)]
    pub yaw_deg: Option<Spanned<f64>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct OffsetTable {
    pub objects: Spanned<Vec<Spanned<String>>>,
    pub x_m: Option<Spanned<Extent>>,
    pub y_m: Option<Spanned<Extent>>,
    pub z_m: Option<Spanned<Extent>>,
    pub yaw_deg: Option<Spanned<Extent>>,
    /// Additional yaw in either direction at `--spread 2`.
    pub wider_yaw_deg: Option<Spanned<f64>>,
    /// True for objects on a wall across y. `--spread 2` does not widen their y range, which would move
    /// them into the wall or off it.
    #[serde(default)]
    pub on_wall: bool,
}

/// Range of an offset: symmetric about zero, or between two numbers.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub enum Extent {
    EitherWay(f64),
    FromTo([f64; 2]),
}

/// A phase: `done` alone, or `first` and `then`, or `lasting` and `for_s`, or `milestones`.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PhaseTable {
    pub id: Spanned<String>,
    pub description: Spanned<String>,
    #[serde(default)]
    pub collaborative: bool,
    pub done: Option<Spanned<String>>,
    pub first: Option<Spanned<String>>,
    pub then: Option<Spanned<String>>,
    pub broken: Option<Spanned<String>>,
    pub lasting: Option<Spanned<String>>,
    pub for_s: Option<Spanned<f64>>,
    pub at_end: Option<Spanned<String>>,
    pub milestones: Option<Spanned<Vec<MilestoneTable>>>,
    /// Condition that makes the phase unreachable once it has held while the phase was next.
    pub spoiled: Option<Spanned<String>>,
    /// Nearness from 0 to 1, for dense rewards.
    pub near: Option<Spanned<String>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MilestoneTable {
    pub condition: Spanned<String>,
    pub for_s: Option<Spanned<f64>>,
}
