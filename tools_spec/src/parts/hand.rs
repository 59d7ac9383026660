//! How a hand did under a command.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::pose::Pose;

/// How one hand did under a command, at its last step.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReport {
    /// How the wrist stands to its target.
    pub state: HandState,
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
    /// The joint of this arm and hand that works hardest.
    pub largest_effort: Effort,
    /// Force of the world on the hand in newtons, in the pelvis frame, as the arm's own joints feel it: a hand that holds 0.5 kg
    /// feels about -4.9 along z; one in quick motion feels its own inertia, too.
    pub force_n: [f64; 3],
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
    /// How they stand to their targets.
    pub state: HandState,
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
