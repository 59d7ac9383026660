//! A task's file as TOML has it, before anything in it has been looked up. Spans say where in the file a value stands.

use std::collections::BTreeMap;

use serde::Deserialize;
use toml::Spanned;

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TaskTable {
    pub id: Spanned<String>,
    /// A room that the program carries, or an MJCF file beside this one.
    pub scene: Option<Spanned<String>>,
    /// The scene itself.
    pub scene_mjcf: Option<Spanned<String>>,
    pub instruction: Spanned<String>,
    /// What operators of one robot each read in its place, where it tells what not every robot may know.
    pub shared_instruction: Option<Spanned<String>>,
    /// The same in other words, for levels 1, 2 and 3 of stress.
    pub rewordings: Option<Spanned<Vec<RewordingTable>>>,
    /// Hands have to close, whatever conditions ask for.
    #[serde(default)]
    pub needs_fingers: bool,
    #[serde(default)]
    pub budget: BudgetTable,
    /// What the seed chooses among: `{name}` in the texts of the file stands for the option.
    #[serde(default)]
    pub choices: Vec<ChoiceTable>,
    pub robots: Spanned<Vec<RobotTable>>,
    #[serde(default)]
    pub objects: Vec<ObjectTable>,
    #[serde(default)]
    pub randomize: Vec<OffsetTable>,
    /// Names for expressions; each may name those that stand before it.
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

/// What is told in the place of the instructions of the same names.
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
    /// An object that the program carries, or an MJCF file beside this one; as the object is called where it is left out.
    pub file: Option<Spanned<String>>,
    /// The object itself.
    pub mjcf: Option<Spanned<String>>,
    pub position_m: Spanned<[f64; 3]>,
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
    /// How much farther `--spread 2` turns them, either way.
    pub wider_yaw_deg: Option<Spanned<f64>>,
    /// They hang on a wall across y: `--spread 2` does not widen y, which would bring them into it or off it.
    #[serde(default)]
    pub on_wall: bool,
}

/// How far an offset goes: so much either way, or from one number to another.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(untagged)]
pub enum Extent {
    EitherWay(f64),
    FromTo([f64; 2]),
}

/// One phase: `done` alone, or `first` and `then`, or `lasting` and `for_s`, or `milestones`.
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
    /// What makes the phase impossible to reach, once it has held while the phase was next.
    pub spoiled: Option<Spanned<String>>,
    /// A number from 0 to 1 for dense rewards.
    pub near: Option<Spanned<String>>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MilestoneTable {
    pub condition: Spanned<String>,
    pub for_s: Option<Spanned<f64>>,
}
