//! What became of a command.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
use super::hand::HandReport;
use super::pose::Pose;

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
    /// Every robot of the episode.
    pub fallen: Vec<RobotFallen>,
    /// Every phase reached so far, where the episode's disclosure tells it.
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
    /// Where its own legs and gyro have it: the pose of its pelvis in the start frame, which lies on the floor under the pelvis as
    /// it was when the episode began, z up, x where the robot faced. Drifts by up to 1 % of the way walked.
    pub pelvis_in_start: Pose,
    /// How far the command took the base, by the same odometry.
    pub base_motion: BaseMotion,
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
