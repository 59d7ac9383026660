//! The reply to several commands by one call.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::command::CommandReply;
use super::episode::HeldObject;

/// The reply to `send_plan` and `walk_to`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanReply {
    /// Commands that were carried out: of a plan, those that it lists; of a walk, each short one.
    pub commands: u32,
    /// Tool calls of all robots up to now, as results count them: each command of a plan or walk is one, and
    /// each slice of 5 steps with `until`. No budget limits them. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_calls: Option<u32>,
    /// Control steps of 20 ms that they took together.
    pub executed_steps: u32,
    /// Why no more were; null where all was done.
    pub stopped: Option<String>,
    /// A line for each command of a plan that was begun: its steps, and where that left the robots. Left out
    /// where there is one command.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outcomes: Vec<String>,
    /// Objects in hands after a walk with `carry`, in its frame; left out otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<HeldObject>,
    /// The reply to the last command that was carried out.
    pub last: CommandReply,
}
