//! What became of a command.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
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
    /// One report per robot that the command named.
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
}

/// How one hand did under a command, at its last step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReport {
    /// The wrist pose that was asked for, in the pelvis frame as it is now; of an arm without a wrist target, the pose that
    /// its joint targets stand for.
    pub target: Pose,
    /// The wrist pose that was measured, in the pelvis frame as it is now.
    pub measured: Pose,
    /// Distance from target to measured, in metres.
    pub position_error_m: f64,
    /// Angle from target to measured, in radians.
    pub orientation_error_rad: f64,
    /// Joints of this arm and hand whose target lay beyond a limit and was moved to it.
    pub joints_clamped: Vec<String>,
    /// Joints of this arm and hand that rest at a limit.
    pub joints_at_limit: Vec<String>,
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
    /// Waist joints whose target lay beyond a limit and was moved to it.
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints that rest at a limit.
    pub waist_joints_at_limit: Vec<String>,
    /// Fields of the base command that lay beyond what locomotion accepts and were moved to it, as `vx_m_s`.
    pub base_command_clamped: Vec<String>,
}
