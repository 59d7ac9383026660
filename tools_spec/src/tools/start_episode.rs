//! `start_episode`: makes a world and says what stands in it. `gateway/src/hosting/table.rs` carries it out.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

use super::get_status::StatusReply;
use crate::parts::{BaseLimits, OperatorToken, Protocol};
use crate::tool::{Route, Tool};

/// Start an episode of a task. Returns the episode_id that other tools need, the instruction, a brief on
/// frames, cameras and hands, the robots and the budget. Task, seed and commands decide all that happens.
/// Physics stands still between calls.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct StartEpisode {
    /// Id of a task from list_tasks, for example "handover".
    pub task: String,
    /// Decides where the objects are: 0 to 4294967295.
    #[schemars(range(max = u32::MAX))]
    pub seed: u32,
    /// The rules. Null: "agentic".
    pub protocol: Option<Protocol>,
    /// True: without the lists of joints and columns that only send_joint_chunk needs.
    #[serde(default)]
    pub short: bool,
}

impl Tool for StartEpisode {
    type Reply = StartReply;
    const NAME: &'static str = "start_episode";
    const READ_ONLY: bool = false;

    fn example() -> Self {
        StartEpisode { task: "handover".into(), seed: 0, protocol: Some(Protocol::Agentic), short: false }
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
    /// An episode to which no call comes for as many seconds ends.
    pub idle_limit_s: u64,
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
    /// What those who direct one robot each read in place of `instruction`, where that tells what not all of them may know; left out
    /// where they may read it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared_instruction: Option<String>,
    /// What each robot has to do.
    pub instructions: Vec<Instruction>,
    /// The robots.
    pub robots: Vec<RobotInfo>,
    /// The phases of the task, in the order they have to be reached; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<PhaseInfo>,
    /// The things of the task: how large they are, along the first robot's axes, and how far from each robot they stand before the seed
    /// moves them by a decimetre or so. Left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub room: Vec<String>,
    /// How the episode ends, and when phases are told.
    pub ending: String,
    /// What can be asked of robots of each kind.
    pub kinds: Vec<RobotKind>,
    /// What has to be known to see and to act.
    pub brief: Brief,
    /// The columns of a row of send_joint_chunk; left out of a short reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub action_row: Vec<String>,
    /// Where the episode stands after the initial hold.
    pub status: StatusReply,
    /// Why the recording is not complete; left out where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
}

impl Briefing {
    /// The briefing as whoever directs this robot alone reads it.
    pub fn for_robot(mut self, robot: &str) -> Briefing {
        self.instructions.retain(|entry| entry.robot == robot);
        self.status.fallen.retain(|entry| entry.robot == robot);
        self.instruction = self.shared_instruction.take().unwrap_or(self.instruction);
        self
    }

    /// The briefing as it is told shortly.
    pub fn shortened(mut self) -> Briefing {
        self.action_row.clear();
        self.kinds.iter_mut().for_each(|kind| kind.joints.clear());
        self
    }
}

/// One phase of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseInfo {
    /// What the phase is called, as `transfer`.
    pub id: String,
    /// `p1`, `p2`, ...
    pub number: String,
    /// When the phase counts as reached.
    pub description: String,
    /// Whether more than one robot has to work on it.
    pub collaborative: bool,
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
    /// Its joints; left out of a short reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
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
    /// How an operator plays with partners; left out where one policy directs all robots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teamwork: Option<String>,
    /// What is known of a robot's own way; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<String>,
    /// The camera's convention, and what moves it.
    pub camera: String,
    /// The shape of a hand.
    pub hands: String,
    /// How walking goes, as measured, and what replies say of the base; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walking: Option<String>,
    /// How to grasp; left out where the server gives no hints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grasping: Option<String>,
    /// Grips that work, as `grasping` says how to use them; left out where the server gives no hints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grips: Vec<WorkedGrip>,
}

impl Brief {
    /// All of it, a line each.
    pub fn lines(&self) -> Vec<String> {
        let Brief { frames, partners, teamwork, odometry, camera, hands, walking, grasping, grips } = self;
        let told = [frames, partners]
            .into_iter()
            .chain(teamwork)
            .chain(odometry)
            .chain([camera, hands])
            .chain(walking)
            .chain(grasping);
        told.cloned().chain(grips.iter().map(|grip| json!(grip).to_string())).collect()
    }
}

/// A grip that works, of a right hand whose robot faces the thing squarely.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorkedGrip {
    /// What it is for.
    pub thing: String,
    /// Which point of the thing `place_m` is.
    pub place: String,
    /// How the right wrist is turned, in the level frame.
    pub right_quaternion_wxyz: [f64; 4],
    /// How the left wrist is.
    pub left_quaternion_wxyz: [f64; 4],
    /// Where the place lies in the right wrist's frame while the hand holds it; negate y for a left hand.
    pub place_m: [f64; 3],
    /// Where the hand stops on its way in, the farthest first: so much is added to `place_m` there.
    pub stops_m: Vec<[f64; 3]>,
    /// Finger angles of a right hand on its way in and out, as right_fingers_rad; a left one negates all but the first.
    pub open_rad: [f64; 7],
    /// Finger angles of a right hand that holds.
    pub close_rad: [f64; 7],
    /// How far behind the places of its hands the pelvis stands; left out where that does not matter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stand_behind_m: Option<f64>,
    /// How low the pelvis is commanded, so that hands come there; left out where the robot stands upright.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_height_m: Option<f64>,
}
