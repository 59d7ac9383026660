//! What became of a command, robot by robot and hand by hand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
use super::quantities::Pose;

/// The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandReply {
    /// Control steps of 20 ms that were executed.
    pub executed_steps: u32,
    /// Why the command ended.
    pub stop_reason: StopReason,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// One report per robot that the command named; after `wait`, one per robot of the episode.
    pub robots: Vec<RobotReport>,
    /// Every robot of the episode; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fallen: Vec<RobotFallen>,
    /// Every phase reached so far, where the episode's assistance tells it.
    pub phases: Vec<PhaseReached>,
    /// What is left of the episode.
    pub budget: Budget,
}

/// Why a command ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// Every step that was asked for was executed.
    StepsDone,
    /// The last phase of the task was reached, which has ended the episode.
    TaskComplete,
    /// The episode's steps ran out; the episode has ended.
    StepBudgetExhausted,
    /// The command of another operator was shorter, and this one was cut off with it; it goes on where a further command takes it.
    PartnerDone,
}

/// How one robot did under a command.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotReport {
    /// The robot, as "A".
    pub robot: String,
    /// Its left arm and hand.
    pub left: HandReport,
    /// Its right arm and hand.
    pub right: HandReport,
    /// Where its own IMU and joints have it: the pose of its pelvis in the start frame, which lies on the floor under the pelvis as
    /// it was when the episode began, z up, x where the robot faced. Drifts by up to 1 % of the way walked. Left out where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_start: Option<Pose>,
    /// How far the command took the base, by the same odometry; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_motion: Option<BaseMotion>,
    /// Waist joints whose target lay beyond a limit and was moved to it.
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints that rest at a limit.
    pub waist_joints_at_limit: Vec<String>,
    /// Fields of the base command that lay beyond what locomotion accepts and were moved to it, as `vx_m_s`.
    pub base_command_clamped: Vec<String>,
}

/// How a pelvis moved during a command, forward and left as the robot faced when the command began.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseMotion {
    /// Forward, in metres.
    pub forward_m: f64,
    /// To the left, in metres.
    pub left_m: f64,
    /// Upwards, in metres.
    pub up_m: f64,
    /// How far it turned, in radians, counter-clockwise seen from above.
    pub turned_rad: f64,
}

/// How one hand did under a command, at its last step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReport {
    /// How the wrist stands to its target; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<HandState>,
    /// The wrist pose that was asked for, in the pelvis frame as it is now; of an arm without a wrist target, the pose that
    /// its joint targets stand for.
    pub target: Pose,
    /// The wrist pose that was measured, in the pelvis frame as it is now.
    pub measured: Pose,
    /// Distance from target to measured, in metres.
    pub position_error_m: f64,
    /// Angle from target to measured, in radians.
    pub orientation_error_rad: f64,
    /// Its fingers.
    pub fingers: FingerReport,
    /// The joint of this arm and hand that works hardest; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_effort: Option<Effort>,
    /// Force of the world on the hand in newtons, in the pelvis frame, as the arm's own joints feel it: a hand that holds 0.5 kg
    /// feels about -4.9 along z; one in quick motion feels its own inertia, too. Left out where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Joints of this arm and hand whose target lay beyond a limit and was moved to it.
    pub joints_clamped: Vec<String>,
    /// Joints of this arm and hand that rest at a limit.
    pub joints_at_limit: Vec<String>,
}

/// How a wrist or fingers stand to their target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HandState {
    /// There: a wrist within 5 mm and 0.05 rad, every finger joint within 0.06 rad.
    Arrived,
    /// On the way.
    Moving,
    /// Stopped short by load or contact: fingers around an object are.
    Blocked,
    /// Stopped short because limits of joints, the arm's length or the robot's own body allow no more.
    OutOfReach,
}

/// How the fingers of one hand did. Angles are [thumb_0, thumb_1, thumb_2, middle_0, middle_1, index_0, index_1].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FingerReport {
    /// How they stand to their targets; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<HandState>,
    /// Joint angles that were asked for, in radians.
    pub target_rad: [f64; 7],
    /// Joint angles that were measured, in radians.
    pub measured_rad: [f64; 7],
}

/// How hard a joint works.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Effort {
    /// The joint, as `right_elbow_joint`.
    pub joint: String,
    /// Its torque as a share of its limit, from 0 to 1.
    pub share: f64,
}
