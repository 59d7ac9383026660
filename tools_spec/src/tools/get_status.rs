//! `get_status`: where the episode stands. `episodes/src/session/status.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finish::EndReason;
use crate::parts::{Budget, Disclosure, PhaseReached, Protocol, RobotFallen};
use crate::tool::Tool;

/// Ask where the episode stands: time, phases reached, who has fallen, and the budget left. Costs no steps; physics stands
/// still. Also answers after the episode has ended.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GetStatus {}

impl Tool for GetStatus {
    type Reply = StatusReply;
    const NAME: &'static str = "get_status";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        GetStatus {}
    }
}

/// The reply to `get_status`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StatusReply {
    /// The task's id.
    pub task: String,
    /// The seed.
    pub seed: u32,
    /// The rules in force.
    pub protocol: Protocol,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// Control steps of 20 ms executed so far, the initial hold included.
    pub env_steps: u32,
    /// Why the episode has ended; null while it goes on.
    pub ended: Option<EndReason>,
    /// Every robot of the episode.
    pub fallen: Vec<RobotFallen>,
    /// What is told of the phases, and whether the last one ends the episode.
    pub disclosure: Disclosure,
    /// Every phase reached so far, where the disclosure tells it.
    pub phases: Vec<PhaseReached>,
    /// What is left of the episode.
    pub budget: Budget,
    /// Hash of the whole physical state, 16 hexadecimal digits. Equal hashes mean equal states.
    pub state_hash: String,
}
