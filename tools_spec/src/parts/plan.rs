//! The reply to several commands in one call.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::command::CommandReply;
use super::episode::HeldObject;

/// The reply to `send_plan` and `walk_to`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlanReply {
    /// Executed commands: those listed in a plan, or the short ones of a walk.
    pub commands: u32,
    /// Tool calls of all robots up to now, as results count them: each command of a plan or walk is one, and
    /// each slice of 5 steps with `until`. No budget limits them. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tool_calls: Option<u32>,
    /// Control steps of 20 ms of these commands.
    pub executed_steps: u32,
    /// Cause of an early stop; null if none.
    pub stopped: Option<String>,
    /// A line for each started command of a plan: its steps, and the robots' state after them. Left out for a
    /// single command.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub outcomes: Vec<String>,
    /// Objects in hands after a walk with `carry`, in its frame; left out otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub held: Vec<HeldObject>,
    /// The reply to the last executed command.
    pub last: CommandReply,
}
