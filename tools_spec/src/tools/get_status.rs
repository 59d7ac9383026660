//! `get_status`: the state of the episode. `episodes/src/session/status.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::finish::EndReason;
use crate::parts::{Assistance, Budget, Disclosure, NextPhase, PhaseReached, Protocol, RobotFallen};
use crate::tool::Tool;

/// Ask how the episode is going: time, phases reached, fallen robots, and the budget left. Costs no steps.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("paper" = "Ask how the episode is going: time, the budget left, and once it has ended the phases that were reached. \
    Costs no steps."))]
#[serde(deny_unknown_fields)]
pub struct GetStatus {
    /// True: also what the next phase lacks, and where held things are.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("full_only" = true, "default" = false))]
    pub explain: bool,
}

impl Tool for GetStatus {
    type Reply = StatusReply;
    const NAME: &'static str = "get_status";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        GetStatus::default()
    }
}

/// The reply to `get_status`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StatusReply {
    /// The task's id.
    pub task: String,
    /// The seed; left out of a short reply, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// The rules in force.
    pub protocol: Protocol,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// Control steps of 20 ms executed up to now, the initial hold included.
    pub env_steps: u32,
    /// Cause of the end; null while the episode runs.
    pub ended: Option<EndReason>,
    /// Every robot of the episode; in a short reply those that have fallen. Left out where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fallen: Vec<RobotFallen>,
    /// Amount of information. With "paper", phases are disclosed once the episode has ended; success does not
    /// end it: call finish. With "full", the last phase ends the episode.
    pub assistance: Assistance,
    /// Disclosure of phases, if unlike the assistance's; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub disclosure: Option<Disclosure>,
    /// Every phase reached up to now, where the assistance discloses it.
    pub phases: Vec<PhaseReached>,
    /// The next phase and its unmet conditions; left out unless requested, and where phases are not
    /// disclosed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub next_phase: Option<NextPhase>,
    /// Remaining budget of the episode.
    pub budget: Budget,
    /// Hash of the whole physical state, 16 hexadecimal digits. Equal hashes mean equal states. Left out of
    /// a short reply, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state_hash: Option<String>,
}
