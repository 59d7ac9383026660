//! `send_plan`: several commands in one call. `episodes/src/session/plan/` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value, json};

use crate::checks;
use crate::parts::CommandReply;
use crate::tool::Tool;
use crate::tools::{MoveWrists, SendJointChunk, Wait, Walk};

/// The most commands of a plan.
const MAX_COMMANDS: usize = 20;

/// Carry out up to 20 commands one after another, each as if it had been called by itself: with its own steps, recorded and counted as a
/// tool call. The plan stops after the first command after which something that it `expects` is not so. The reply is that of the last command
/// carried out, with how many were and why no more. If any command could not be carried out, none is.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SendPlan {
    /// The commands, at most 20.
    #[schemars(length(min = 1, max = MAX_COMMANDS))]
    pub commands: Vec<PlannedCommand>,
}

/// One command of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PlannedCommand {
    /// "move_wrists", "walk", "wait" or "send_joint_chunk".
    #[schemars(extend("enum" = SendPlan::COMMANDS))]
    pub tool: String,
    /// The arguments of that tool, without episode_id.
    pub arguments: Map<String, Value>,
    /// What has to be so afterwards for the plan to go on. Null: nothing.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub expects: Option<Expectation>,
}

/// What is expected of the robots that a command named, or of all after `wait`, once it is done. What is null is not looked at.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Expectation {
    /// Whether every wrist that has a target has arrived there.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arrived: Option<bool>,
    /// Whether a wrist is blocked or out of reach.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub blocked: Option<bool>,
    /// That a hand feels more than as many newtons.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_above_n: Option<f64>,
    /// That no hand feels more than as many newtons.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_below_n: Option<f64>,
    /// That this phase has been reached, as "p1".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub phase_reached: Option<String>,
    /// Whether a robot steps, or settles after it was told to walk.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_stepping: Option<bool>,
}

impl SendPlan {
    /// The tools that a plan may name: every one that commands.
    pub const COMMANDS: [&str; 4] = [MoveWrists::NAME, Walk::NAME, SendJointChunk::NAME, Wait::NAME];

    /// Returns what messages call the command at `index`.
    pub fn place(&self, index: usize) -> String {
        format!("command {} of {}", index + 1, self.commands.len())
    }
}

impl Tool for SendPlan {
    type Reply = PlanReply;
    const NAME: &'static str = "send_plan";
    const READ_ONLY: bool = false;
    /// Whatever tool a command names, its arguments are an object that its own schema describes.
    const STRICT: bool = false;
    const FULL_ONLY: bool = true;

    fn example() -> Self {
        let object = |value: Value| value.as_object().cloned().unwrap_or_default();
        let command = |tool: &str, arguments: Value, expects: Option<Expectation>| PlannedCommand {
            tool: tool.into(),
            arguments: object(arguments),
            expects,
        };
        let arrived = Expectation { arrived: Some(true), ..Expectation::default() };
        let reach = command(
            MoveWrists::NAME,
            json!({ "steps": 25, "robots": [{ "robot": "A", "right_position_m": [0.3, -0.2, 0.1] }] }),
            None,
        );
        let wait = command(Wait::NAME, json!({ "steps": 10 }), Some(arrived));
        SendPlan { commands: vec![reach, wait] }
    }

    fn validate(&self) -> Result<(), String> {
        match self.commands.len() {
            0 => return Err("commands is empty; give 1 to 20".into()),
            count if count > MAX_COMMANDS => {
                return Err(format!("commands holds {count}; give at most {MAX_COMMANDS}"));
            }
            _ => {}
        }
        for (index, command) in self.commands.iter().enumerate() {
            let Some(Expectation { force_above_n, force_below_n, .. }) = &command.expects else { continue };
            for (name, force_n) in [("force_above_n", force_above_n), ("force_below_n", force_below_n)] {
                checks::finite(&format!("{}: expects.{name}", self.place(index)), force_n.as_slice())?;
            }
        }
        let names = self.commands.iter().map(|command| command.tool.as_str()).enumerate();
        match names.into_iter().find(|(_, name)| !SendPlan::COMMANDS.contains(name)) {
            Some((index, name)) => Err(format!(
                "{}: {name:?} is no command; have: {}",
                self.place(index),
                SendPlan::COMMANDS.join(", ")
            )),
            None => Ok(()),
        }
    }
}

/// The reply to `send_plan` and `walk_to`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanReply {
    /// Commands that were carried out. Each counts as a tool call of the episode.
    pub commands: u32,
    /// Tool calls of the episode so far.
    pub tool_calls: u32,
    /// Control steps of 20 ms that they took together.
    pub executed_steps: u32,
    /// Why no more were; null where all was done.
    pub stopped: Option<String>,
    /// The reply to the last command that was carried out.
    pub last: CommandReply,
}
