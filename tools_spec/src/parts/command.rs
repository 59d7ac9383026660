//! Replies to commands, robot by robot and hand by hand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
use super::frames::PoseFrame;
use super::quantities::Pose;

/// The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`. Lengths are told to
/// the millimetre, angles and quaternions to a thousandth. What is marked so is left out where the call
/// asked for a short reply.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CommandReply {
    /// Control steps of 20 ms that were executed.
    pub executed_steps: u32,
    /// Why the command ended.
    pub stop_reason: StopReason,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// One report per robot that the command named; after `wait`, one per robot of the episode. In a short
    /// reply without robots that stand where they stood, whose hands have no target and feel nothing.
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
    /// The command of another operator was shorter, and this one was cut off with it; it goes on where a
    /// further command takes it.
    PartnerDone,
}

/// Outcome of a command for one robot.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotReport {
    /// The robot, for example "A".
    pub robot: String,
    /// The frame of wrist poses: the command's, or that of a walk's places; left out for that of the pelvis.
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
    /// the pelvis at the start of the episode, z up, x the robot's heading then. Drifts by up to 1 % of the
    /// way walked. Left out of a short reply where the base has moved by less than a centimetre and a
    /// hundredth of a radian, but not after `walk_to`, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_start: Option<Pose>,
    /// The same in the room frame, where `frame` is that; left out otherwise. In a short reply it stands for
    /// `pelvis_in_start`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_room: Option<Pose>,
    /// Motion of the base during the command, by the same odometry. Left out of a short reply, and where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_motion: Option<BaseMotion>,
    /// Waist joints whose target lay beyond a limit and was moved to it; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints that rest at a limit; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_at_limit: Vec<String>,
    /// Fields of the base command that lay beyond what locomotion accepts and were moved to it, as
    /// `vx_m_s`; left out where there are none.
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
    /// Predicted resting place of the pelvis if no further step is commanded, [x, y] in the start frame: to
    /// within 3 cm after a walk of up to 2.5 s, 5 cm after a longer one. Only of a base that steps or
    /// settles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comes_to_rest_m: Option<[f64; 2]>,
    /// Displacement of a base that was commanded to stand from its resting place, [forward, left] in metres
    /// as it faced there: something pulled or pushed it. Left out below 2 cm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displaced_m: Option<[f64; 2]>,
    /// True where it took a step during the command though it was commanded to stand, after arms that reach far
    /// or what pulls at them; left out otherwise.
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
    /// Both feet stay where they are, and the pelvis is as high as it gets.
    Standing,
    /// It walks as commanded.
    Stepping,
    /// It was commanded to stop and still steps, or its pelvis still rises or sinks to the commanded height.
    Settling,
    /// It steps without a command: what its hands hold or touch, or a partner, pulls or pushes it.
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
    /// Parts of the hand that press, by the torques of the fingers' own drives; left out where none does, of a
    /// short reply where the grip is "two_sided", and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub presses: Vec<HandPart>,
    /// Obstacle that the hand feels; left out where it feels none, of a short reply where `grip` tells it, and
    /// where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touches: Option<Touch>,
    /// The wrist pose that was asked for, in the pelvis frame as it is now, and not where the hand has
    /// given way to since; of an arm without a wrist target, the pose that its joint targets stand for.
    /// Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<Pose>,
    /// The wrist pose that was measured, in the pelvis frame as it is now, its quaternion with the sign
    /// that is nearer to the target's. Left out of a short reply where the state is "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Pose>,
    /// Distance from target to measured, in metres. Left out of a short reply where the state is "arrived"
    /// or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_error_m: Option<f64>,
    /// Angle from target to measured, in radians; left out as the distance is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_error_rad: Option<f64>,
    /// Yielding of the hand by the command's compliance: offset of the yielded target from `target`, [x, y,
    /// z] in metres in the pelvis frame, against which its state is reported. Left out where it has not
    /// yielded, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_way_m: Option<[f64; 3]>,
    /// Its fingers; left out of a short reply where they have arrived or the grip is "two_sided".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingers: Option<FingerReport>,
    /// The joint of this arm and hand that works hardest; left out of a short reply where it works at less
    /// than four fifths of its limit or is of a finger, as of each that presses, and where the assistance
    /// is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_effort: Option<Effort>,
    /// Force of the world on the hand in newtons, [x, y, z] in the pelvis frame, as the arm's own joints
    /// feel it: a hand that holds 0.5 kg feels about -4.9 along z, one that presses ahead on something a
    /// negative x. What moving the arm takes is not counted; an arm that hangs free may feel up to 5 N of
    /// its own friction. Left out of a short reply where it is less than 1 N, of an arm that keeps its
    /// joints and holds nothing less than 6 N, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Joints of this arm and hand whose target lay beyond a limit and was moved to it; left out where
    /// there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints_clamped: Vec<String>,
    /// Joints of this arm that rest at a limit; left out where there are none, and of a short reply where
    /// the state is "arrived" or "idle".
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
    /// The thumb presses, and fingers or palm do. That is a hold, as phases ask for, where they press on
    /// opposite sides, which a hand cannot feel: on a round thing that lies at the fingertips, or only
    /// hangs in a bent hand, they press on neighbouring ones.
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
    /// The palm, on which the thumb presses something: the arm feels nothing of that force.
    Palm,
}

/// Contact of a hand, as far as it can feel that.
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
    /// There: a wrist within 5 mm and 0.05 rad, or of a hand that holds something, under which its arm
    /// sags, within 15 mm and 0.15 rad; every finger joint within 0.06 rad.
    Arrived,
    /// A wrist without a target, whose arm keeps its joints.
    Idle,
    /// Coming nearer.
    Moving,
    /// Stopped short by load or contact: fingers around an object are, and an arm that was pushed away.
    Blocked,
    /// Stopped short because limits of joints, the arm's length or the robot's own body allow no more.
    OutOfReach,
}

/// Outcome of a command for the fingers of one hand. Angles are [thumb_0, thumb_1, thumb_2, middle_0,
/// middle_1, index_0, index_1].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct FingerReport {
    /// State against their targets; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<HandState>,
    /// Joint angles that were asked for, in radians. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_rad: Option<[f64; 7]>,
    /// Joint angles that were measured, in radians.
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
