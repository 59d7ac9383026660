//! `start_episode`: makes a world and says what stands in it. `gateway/src/hosting/table.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::get_status::StatusReply;
use crate::parts::{BaseLimits, OperatorToken, Protocol};
use crate::tool::{Route, Tool};

/// Start an episode of a task. Returns episode_id, which every other tool needs, the instruction, a brief on frames, cameras
/// and hands, the robots with their joints and limits, and the budget. The same task, seed and commands always give the same episode. Physics stands
/// still between calls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartEpisode {
    /// The id of a task from list_tasks, as "handover".
    pub task: String,
    /// Decides where the objects stand: 0 to 4294967295. Results are reported on the seeds that list_tasks names.
    #[schemars(range(max = u32::MAX))]
    pub seed: u32,
    /// The rules: "agentic" for agents that think between commands, "benchmark" for learned policies. Null: "agentic".
    pub protocol: Option<Protocol>,
}

impl Tool for StartEpisode {
    type Reply = StartReply;
    const NAME: &'static str = "start_episode";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        StartEpisode { task: "handover".into(), seed: 0, protocol: Some(Protocol::Agentic) }
    }

    fn route() -> Route {
        Route { method: "POST", path: "/v1/episodes".into() }
    }
}

/// The reply to `start_episode`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct StartReply {
    /// The handle that every other tool needs.
    pub episode_id: String,
    /// What each robot's operator needs, where each robot has one of its own; left out otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operators: Vec<OperatorToken>,
    /// What the policy has to know.
    #[serde(flatten)]
    pub briefing: Briefing,
}

/// What a policy is told when an episode begins.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Briefing {
    /// What has to be done.
    pub instruction: String,
    /// What each robot has to do.
    pub instructions: Vec<Instruction>,
    /// The robots.
    pub robots: Vec<RobotInfo>,
    /// What can be asked of robots of each kind.
    pub kinds: Vec<RobotKind>,
    /// What has to be known to see and to act.
    pub brief: Brief,
    /// The columns of a row of send_joint_chunk.
    pub action_row: Vec<String>,
    /// Where the episode stands after the initial hold.
    pub status: StatusReply,
    /// Why the recording is not complete; left out where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
}

/// What one robot has to do.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Instruction {
    /// The robot, as "A".
    pub robot: String,
    /// Its part of the task.
    pub instruction: String,
}

/// One robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotInfo {
    /// The robot, as "A".
    pub robot: String,
    /// Which of `kinds` it is.
    pub kind: String,
}

/// A kind of robot: its joints in published order, and what its locomotion accepts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotKind {
    /// What `robots` call it.
    pub kind: String,
    /// Its joints.
    pub joints: Vec<JointInfo>,
    /// The base commands that its locomotion accepts.
    #[serde(flatten)]
    pub base_limits: BaseLimits,
}

/// One joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct JointInfo {
    /// Unitree's name, as `left_elbow_joint`.
    pub name: String,
    /// Lower limit in radians.
    pub lower_rad: f64,
    /// Upper limit in radians.
    pub upper_rad: f64,
    /// The largest torque that its drive exerts, in newton metres.
    pub effort_n_m: f64,
}

/// What has to be known of the robots to see and to act, in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Brief {
    /// The frames that poses are given in.
    pub frames: String,
    /// How the frames of different robots are related.
    pub partners: String,
    /// What is known of a robot's own way; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<String>,
    /// The camera's convention, and what moves it.
    pub camera: String,
    /// The shape of a hand.
    pub hands: String,
    /// How to grasp; left out where the server gives no hints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grasping: Option<String>,
}
