//! Replies to commands, with reports on robots and hands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
use super::frames::PoseFrame;
use super::quantities::Pose;

/// The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`. Lengths are rounded to a
/// millimetre, angles and quaternions to a thousandth. Marked fields are left out of a short reply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandReply {
    /// Control steps of 20 ms that were executed.
    pub executed_steps: u32,
    /// Reason for its end.
    pub stop_reason: StopReason,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// One report per robot that the command named; after `wait`, per robot of the episode. A short reply
    /// omits robots that have not moved and whose hands have no target and feel nothing.
    pub robots: Vec<RobotReport>,
    /// Every robot of the episode; in a short reply those that have fallen. Left out where the assistance
    /// is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub fallen: Vec<RobotFallen>,
    /// Every phase reached up to now, where the episode's assistance discloses it; in a short reply those
    /// reached during the call.
    pub phases: Vec<PhaseReached>,
    /// Remaining budget of the episode.
    pub budget: Budget,
}

/// End of a command.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum StopReason {
    /// Every requested step was executed.
    StepsDone,
    /// The last phase of the task was reached, which ended the episode.
    TaskComplete,
    /// The episode's steps ran out; the episode has ended.
    StepBudgetExhausted,
    /// Another operator's command was shorter and cut this one off; a further command continues it.
    PartnerDone,
}

/// Outcome of a command for one robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotReport {
    /// The robot, for example "A".
    pub robot: String,
    /// Frame of wrist poses, from the command or the walk's targets; left out for the pelvis frame.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<PoseFrame>,
    /// Its left arm and hand.
    pub left: HandReport,
    /// Its right arm and hand.
    pub right: HandReport,
    /// State of its base; left out of a short reply where it stands as commanded, and where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseReport>,
    /// Pose of its pelvis in the start frame by its own IMU and joints. The start frame is on the floor under
    /// the pelvis at the start of the episode, z up, x along its heading. Drifts by up to 1 % of the distance
    /// walked. Left out of a short reply where the base has moved by less than a centimetre and a hundredth
    /// of a radian, but not after `walk_to`, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_start: Option<Pose>,
    /// The same in the room frame, if that is `frame`; left out otherwise. In a short reply it replaces
    /// `pelvis_in_start`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_room: Option<Pose>,
    /// Motion of the base during the command, by the same odometry. Left out of a short reply, and where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_motion: Option<BaseMotion>,
    /// Waist joints whose target exceeded a limit and was clamped; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints at a limit; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_at_limit: Vec<String>,
    /// Base command fields that exceeded locomotion's limits and were clamped, for example `vx_m_s`; left out
    /// where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub base_command_clamped: Vec<String>,
}

/// Motion of a base, by its own controller and odometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseReport {
    /// Standing or stepping, and the reason; left out where its controller does not distinguish them.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<BaseState>,
    /// Measured height of the pelvis over the floor, in metres.
    pub pelvis_height_m: f64,
    /// Commanded height, where the measured one is more than 2 cm off; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commanded_height_m: Option<f64>,
    /// Predicted resting place of the pelvis if no further step is commanded, [x, y] in the start frame:
    /// within 3 cm after a walk of up to 2.5 s, 5 cm after a longer one. Only for a base that steps or
    /// settles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comes_to_rest_m: Option<[f64; 2]>,
    /// Displacement from its resting place of a base commanded to stand, [forward, left] in metres by its
    /// heading there: something pulled or pushed it. Left out below 2 cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displaced_m: Option<[f64; 2]>,
    /// True if it stepped though commanded to stand, because its arms reached far or were pulled; left out
    /// otherwise.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stepped: bool,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// State of a base.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BaseState {
    /// Both feet stay in place, and the pelvis has reached its height.
    Standing,
    /// It walks as commanded.
    Stepping,
    /// It was commanded to stop and still steps, or its pelvis still rises or sinks to the commanded height.
    Settling,
    /// It steps without a command: a held or touched object, or a partner, pulls or pushes it.
    Pushed,
}

/// Motion of a pelvis during a command, along the robot's heading when it began.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseMotion {
    /// Forward, in metres.
    pub forward_m: f64,
    /// To the left, in metres.
    pub left_m: f64,
    /// Upwards, in metres.
    pub up_m: f64,
    /// Turn in radians, counter-clockwise from above.
    pub turned_rad: f64,
}

/// Outcome of a command for one hand, at its last step.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct HandReport {
    /// State of the wrist against its target; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<HandState>,
    /// Grip by the fingers' own torques; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip: Option<Grip>,
    /// Parts of the hand that press, by the torques of the fingers' own drives; left out where none does, of
    /// a short reply where the grip is "two_sided", and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub presses: Vec<HandPart>,
    /// Obstacle that the hand feels; left out where it feels none, of a short reply if `grip` says so, and
    /// where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touches: Option<Touch>,
    /// Commanded wrist pose in the present pelvis frame, without later yielding; for an arm without a wrist
    /// target, the pose of its joint targets. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<Pose>,
    /// Measured wrist pose in the present pelvis frame, its quaternion with the sign nearer to the target's.
    /// Left out of a short reply where the state is "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Pose>,
    /// Distance from target to measured, in metres. Left out of a short reply where the state is "arrived"
    /// or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_error_m: Option<f64>,
    /// Angle from target to measured, in radians; left out like the distance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_error_rad: Option<f64>,
    /// Offset of the target that compliance has moved from `target`, [x, y, z] in metres in the pelvis frame;
    /// its state refers to the moved target. Left out where it has not yielded, and where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_way_m: Option<[f64; 3]>,
    /// Its fingers; left out of a short reply where they have arrived or the grip is "two_sided".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingers: Option<FingerReport>,
    /// Joint of this arm and hand with the largest share of its torque limit; left out of a short reply if
    /// that is below 0.8 or of a finger, as of each that presses, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_effort: Option<Effort>,
    /// External force on the hand in newtons, [x, y, z] in the pelvis frame, by the arm's own joints: about
    /// -4.9 along z for a held 0.5 kg, a negative x for a hand that presses ahead. Forces that move the arm
    /// are excluded; a free arm may feel up to 5 N of its own friction. Left out of a short reply where it is
    /// less than 1 N, for an arm that keeps its joints and holds nothing less than 6 N, and where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Joints of this arm and hand whose target exceeded a limit and was clamped; left out where there are
    /// none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints_clamped: Vec<String>,
    /// Joints of this arm at a limit; left out where there are none, and of a short reply where the state is
    /// "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints_at_limit: Vec<String>,
}

/// Contact between the fingers of a hand, by the torques of their drives while they are stopped short of
/// their targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Nothing.
    None,
    /// Something, but it is not pressed.
    Touching,
    /// Thumb or fingers press on something and the others do not press against it: close those further.
    OneSided,
    /// The thumb presses, and so do fingers or palm. Phases need pressure from opposite sides, which a hand
    /// cannot feel: on a round object at the fingertips, or hanging in a bent hand, they press on
    /// neighbouring sides.
    TwoSided,
}

/// A part of a hand that presses.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HandPart {
    /// The thumb.
    Thumb,
    /// The middle finger.
    Middle,
    /// The index finger.
    Index,
    /// The palm, against which the thumb presses; the arm does not feel this force.
    Palm,
}

/// Contact that a hand can feel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Touch {
    /// Its own palm or fingers.
    Itself,
    /// Something else.
    Something,
}

/// State of a wrist or of fingers against their target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HandState {
    /// At the target: a wrist within 5 mm and 0.05 rad, or with a load, under which the arm sags, within 15
    /// mm and 0.15 rad; every finger joint within 0.06 rad.
    Arrived,
    /// A wrist without a target, whose arm keeps its joints.
    Idle,
    /// Approaching.
    Moving,
    /// Stopped short by load or contact, for example fingers around an object or an arm pushed away.
    Blocked,
    /// Stopped short by joint limits, the arm's length or the robot's own body.
    OutOfReach,
}

/// Outcome of a command for the fingers of one hand. Angles are [thumb_0, thumb_1, thumb_2, middle_0,
/// middle_1, index_0, index_1].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FingerReport {
    /// State against their targets; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<HandState>,
    /// Commanded joint angles in radians. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_rad: Option<[f64; 7]>,
    /// Measured joint angles in radians.
    pub measured_rad: [f64; 7],
}

/// Effort of a joint.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Effort {
    /// The joint, for example `right_elbow_joint`.
    pub joint: String,
    /// Its torque as a share of its limit, from 0 to 1.
    pub share: f64,
}
