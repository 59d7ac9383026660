//! `list_tasks`: the tasks that can be started. `gateway/src/hosting/table.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::start_episode::{Instruction, PhaseInfo};
use crate::parts::{BaseLimits, Protocol};
use crate::tool::{Route, Tool};

/// List the tasks that start_episode can start: their instructions, the phases they are scored by, the
/// budgets of each protocol, and the robots' limits.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("paper" = "List the tasks that start_episode can start: their instructions and the budgets of each protocol; and how \
    fast and how low the robots can move."))]
#[serde(deny_unknown_fields)]
pub struct ListTasks {
    /// True: only each task's id and instruction; start_episode has the rest.
    #[serde(default)]
    pub short: bool,
}

impl Tool for ListTasks {
    type Reply = TaskList;
    const NAME: &'static str = "list_tasks";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        ListTasks { short: false }
    }

    fn route() -> Route {
        Route { method: "GET", path: "/v1/tasks".into() }
    }
}

/// The reply to `list_tasks`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TaskList {
    /// Every task.
    pub tasks: Vec<TaskInfo>,
    /// The base commands that the robots can follow, in every task.
    pub base_limits: BaseLimits,
}

impl TaskList {
    /// Returns the short form of the list.
    pub fn shortened(mut self) -> TaskList {
        for TaskInfo { id: _, suite: _, instruction: _, robots, phases, protocols } in &mut self.tasks {
            robots.clear();
            phases.clear();
            protocols.clear();
        }
        self
    }
}

/// One task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct TaskInfo {
    /// Id for start_episode, for example `handover`.
    pub id: String,
    /// Its suite, for example `tandem+`; left out for tasks of the benchmark and from files.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub suite: Option<String>,
    /// Instruction for a policy of all robots.
    pub instruction: String,
    /// Instruction for each robot, for policies that direct one; left out of a short reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub robots: Vec<Instruction>,
    /// The phases, in the order they have to be reached; left out of a short reply, and where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<PhaseInfo>,
    /// The protocols and their budgets for this task; left out of a short reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub protocols: Vec<ProtocolInfo>,
}

/// The budgets of one protocol.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProtocolInfo {
    /// The protocol.
    pub protocol: Protocol,
    /// Maximum control steps of 20 ms per command.
    pub steps_per_command: u32,
    /// Control steps of an episode, the initial hold included.
    pub episode_steps: u32,
    /// Control steps that start_episode spends holding still.
    pub initial_hold_steps: u32,
    /// Seconds that the policy may spend between calls; null for no limit.
    pub wall_clock_s: Option<f64>,
    /// First seed that results are reported on.
    pub first_seed: u32,
    /// Last seed that results are reported on.
    pub last_seed: u32,
}
