//! `start_episode`: builds a world and describes it. `gateway/src/hosting/table.rs` carries it out.

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
    /// Handle that every other tool needs.
    pub episode_id: String,
    /// Seconds without a call after which the episode ends.
    pub idle_limit_s: u64,
    /// Credentials of each robot's operator; left out if one policy directs all.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub operators: Vec<OperatorToken>,
    /// The briefing.
    #[serde(flatten)]
    pub briefing: Briefing,
}

/// Briefing of a policy at the start of an episode.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Briefing {
    /// Instruction for all robots.
    pub instruction: String,
    /// Instruction for operators of one robot each, if `instruction` says more than all may know; left out
    /// otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shared_instruction: Option<String>,
    /// Instruction for each robot.
    pub instructions: Vec<Instruction>,
    /// The robots.
    pub robots: Vec<RobotInfo>,
    /// The phases of the task, in the order they have to be reached; left out where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub phases: Vec<PhaseInfo>,
    /// The task's objects: their sizes along the first robot's axes, and their distances from each robot
    /// before the seed moves them by about a decimetre. Left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub room: Vec<String>,
    /// Ways in which the episode ends, and disclosure of phases.
    pub ending: String,
    /// Routes of the tools, for clients over HTTP; left out for all others.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub http: Vec<String>,
    /// Commands and joints of each kind of robot.
    pub kinds: Vec<RobotKind>,
    /// Facts for seeing and acting.
    pub brief: Brief,
    /// The columns of a row of send_joint_chunk; left out of a short reply.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub action_row: Vec<String>,
    /// Status of the episode after the initial hold.
    pub status: StatusReply,
    /// Cause of an incomplete recording; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
}

impl Briefing {
    /// Returns the briefing for the operator of one robot.
    pub fn for_robot(mut self, robot: &str) -> Briefing {
        self.instructions.retain(|entry| entry.robot == robot);
        self.status.fallen.retain(|entry| entry.robot == robot);
        self.instruction = self.shared_instruction.take().unwrap_or(self.instruction);
        self
    }

    /// Returns the briefing of the episode `id` for a client over HTTP.
    pub fn over_http(self, id: &str) -> Briefing {
        let tools = format!("/v1/episodes/{id}/tools");
        let list = format!("GET {tools} lists your tools, each with the schema of its body.");
        let call = format!(
            "POST {tools}/NAME calls one. The JSON body has its arguments, for example {{\"steps\": 25}} for wait."
        );
        let short = "\"short\": true leaves out of a reply what is as it should be. Images are base64 in \
            `images[].png_base64`, 50 kB and more: write a reply of observe to a file.";
        Briefing { http: vec![list, call, short.into()], ..self }
    }

    /// Returns the short form of the briefing.
    pub fn shortened(mut self) -> Briefing {
        self.action_row.clear();
        self.status.fallen.retain(|entry| entry.fallen);
        self.status.state_hash = None;
        self.kinds.iter_mut().for_each(|kind| kind.joints.clear());
        self
    }
}

/// One phase of a task.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PhaseInfo {
    /// Name of the phase, for example `transfer`.
    pub id: String,
    /// `p1`, `p2`, ...
    pub number: String,
    /// Condition for reaching the phase.
    pub description: String,
    /// True if more than one robot has to work on it.
    pub collaborative: bool,
}

/// Instruction of one robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Instruction {
    /// The robot, for example "A".
    pub robot: String,
    /// Its part of the task.
    pub instruction: String,
}

/// One robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotInfo {
    /// The robot, for example "A".
    pub robot: String,
    /// Its kind, one of `kinds`.
    pub kind: String,
}

/// A kind of robot: its joints in published order, and what its locomotion accepts.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotKind {
    /// Name in `robots`.
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
    /// Unitree's name, for example `left_elbow_joint`.
    pub name: String,
    /// Lower limit in radians.
    pub lower_rad: f64,
    /// Upper limit in radians.
    pub upper_rad: f64,
    /// Maximum torque of its drive, in newton metres.
    pub effort_n_m: f64,
}

/// Facts about the robots for seeing and acting, in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Brief {
    /// Frames of poses.
    pub frames: String,
    /// Relation of the frames of different robots.
    pub partners: String,
    /// Playing with partners, for an operator; left out where one policy directs all robots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub teamwork: Option<String>,
    /// Odometry of a robot; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub odometry: Option<String>,
    /// The camera's convention, and what moves it.
    pub camera: String,
    /// The shape of a hand.
    pub hands: String,
    /// Walking as measured, and the base's states in replies; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub walking: Option<String>,
    /// Grasping; left out where the server gives no hints.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grasping: Option<String>,
    /// Working grips, explained in `grasping`; left out where the server gives no hints.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub grips: Vec<WorkedGrip>,
}

impl Brief {
    /// Returns all facts, a line each.
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

/// A working grip of a right hand whose robot squarely faces the object.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct WorkedGrip {
    /// Suitable objects.
    pub thing: String,
    /// Point of the object at `place_m`.
    pub place: String,
    /// Orientation of the right wrist, in the level frame.
    pub right_quaternion_wxyz: [f64; 4],
    /// Orientation of the left wrist.
    pub left_quaternion_wxyz: [f64; 4],
    /// Place of that point in the right wrist's frame while the hand holds it; negate y for a left hand.
    pub place_m: [f64; 3],
    /// Waypoints of the hand's approach, farthest first: offsets from `place_m`.
    pub stops_m: Vec<[f64; 3]>,
    /// Right finger angles for approach and retreat, as in right_fingers_rad; a left hand negates all but the
    /// first.
    pub open_rad: [f64; 7],
    /// Finger angles of a right hand that holds.
    pub close_rad: [f64; 7],
    /// Distance of the pelvis behind the places of its hands; left out where that does not matter.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stand_behind_m: Option<f64>,
    /// Pelvis height for the grip; left out where the robot stands upright.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_height_m: Option<f64>,
}
