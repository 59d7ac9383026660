//! What became of a command, robot by robot and hand by hand.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::episode::{Budget, PhaseReached, RobotFallen};
use super::frames::PoseFrame;
use super::quantities::Pose;

/// The reply to every command: `move_wrists`, `walk`, `send_joint_chunk` and `wait`. Lengths are told to the millimetre, angles and
/// quaternions to a thousandth. What is marked so is left out where the call asked for a short reply.
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
    /// Every robot of the episode; in a short reply those that have fallen. Left out where the assistance is "paper".
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
    /// The frame of wrist poses where the command named another than that of the pelvis; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<PoseFrame>,
    /// Its left arm and hand.
    pub left: HandReport,
    /// Its right arm and hand.
    pub right: HandReport,
    /// What its base does; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base: Option<BaseReport>,
    /// Where its own IMU and joints have it: the pose of its pelvis in the start frame, which lies on the floor under the pelvis as
    /// it was when the episode began, z up, x where the robot faced. Drifts by up to 1 % of the way walked. Left out where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_start: Option<Pose>,
    /// How far the command took the base, by the same odometry; left out where the assistance is "paper", and of a short reply where
    /// it is less than a centimetre and a hundredth of a radian.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_motion: Option<BaseMotion>,
    /// Waist joints whose target lay beyond a limit and was moved to it; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_clamped: Vec<String>,
    /// Waist joints that rest at a limit; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub waist_joints_at_limit: Vec<String>,
    /// Fields of the base command that lay beyond what locomotion accepts and were moved to it, as `vx_m_s`; left out where there
    /// are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub base_command_clamped: Vec<String>,
}

/// What a base does, by its own controller and odometry.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseReport {
    /// Whether it stands or steps, and why; left out where its controller does not tell standing from stepping.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub state: Option<BaseState>,
    /// How high the pelvis is over the floor, in metres: measured, not commanded.
    pub pelvis_height_m: f64,
    /// The height that it was last told, where it is more than 2 cm off that; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub commanded_height_m: Option<f64>,
    /// Where the pelvis will come to rest if no further step is commanded: [x, y] in the start frame, to within 3 cm after a walk of up to
    /// 2.5 s, and to within 5 cm after a longer one. Only of a base that steps or settles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub comes_to_rest_m: Option<[f64; 2]>,
    /// How far a base that was told to stand is from where it came to rest, [forward, left] in metres as it faced there; left out where
    /// that is less than 2 cm. Something pulled or pushed it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub displaced_m: Option<[f64; 2]>,
    /// True where it took a step during the command though it was told to stand, after arms that reach far or what pulls at them; left out
    /// otherwise.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stepped: bool,
}

fn is_false(flag: &bool) -> bool {
    !flag
}

/// Whether a base stands or steps, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum BaseState {
    /// Both feet stay where they are, and the pelvis is as high as it gets.
    Standing,
    /// It walks as it was told to.
    Stepping,
    /// It was told to stop walking and still steps, or its pelvis still rises or sinks to the height that it was told.
    Settling,
    /// It steps though nobody told it to: what its hands hold or touch, or a partner, pulls or pushes it.
    Pushed,
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
    /// What the fingers feel between them, by their own torques; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub grip: Option<Grip>,
    /// What of the hand presses, by the torques of the fingers' own drives; left out where nothing does, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub presses: Vec<HandPart>,
    /// What stops the hand, as far as it can feel that; left out where it feels nothing, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub touches: Option<Touch>,
    /// The wrist pose that was asked for, in the pelvis frame as it is now, and not where the hand has given way to since; of an arm
    /// without a wrist target, the pose that its joint targets stand for. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<Pose>,
    /// The wrist pose that was measured, in the pelvis frame as it is now, its quaternion with the sign that is nearer to the target's.
    /// Left out of a short reply where the state is "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub measured: Option<Pose>,
    /// Distance from target to measured, in metres. Left out of a short reply where the state is "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub position_error_m: Option<f64>,
    /// Angle from target to measured, in radians; left out as the distance is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub orientation_error_rad: Option<f64>,
    /// How far the hand has given way to what pulls it, by the command's compliance: it is to be so far from `target`, [x, y, z] in metres
    /// in the pelvis frame, and its state is told against that. Left out where it has not, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub given_way_m: Option<[f64; 3]>,
    /// Its fingers; left out of a short reply where they have arrived.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fingers: Option<FingerReport>,
    /// The joint of this arm and hand that works hardest; left out of a short reply where it works at less than four fifths of its limit
    /// or is of a finger, as of each that presses, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub largest_effort: Option<Effort>,
    /// Force of the world on the hand in newtons, [x, y, z] in the pelvis frame, as the arm's own joints feel it: a hand that holds
    /// 0.5 kg feels about -4.9 along z, one that presses ahead on something a negative x. What moving the arm takes is not counted; an arm
    /// that hangs free may feel up to 5 N of its own friction. Left out of a short reply where it is less than 1 N, of an arm that keeps
    /// its joints and holds nothing less than 6 N, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub force_n: Option<[f64; 3]>,
    /// Joints of this arm and hand whose target lay beyond a limit and was moved to it; left out where there are none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints_clamped: Vec<String>,
    /// Joints of this arm that rest at a limit; left out where there are none, and of a short reply where the state is "arrived" or "idle".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub joints_at_limit: Vec<String>,
}

/// What the fingers of a hand feel between them: the torques of their drives while they are stopped short of their targets.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Grip {
    /// Nothing.
    None,
    /// Something, but it is not pressed.
    Touching,
    /// Thumb or fingers press on something and the others do not press against it: close those further.
    OneSided,
    /// The thumb presses, and fingers or palm do. That is a hold, as phases ask for, where they press on opposite sides, which a hand cannot
    /// feel: on a round thing that lies at the fingertips, or only hangs in a bent hand, they press on neighbouring ones.
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

/// What a hand touches, as far as it can feel that.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Touch {
    /// Its own palm or fingers.
    Itself,
    /// Something else.
    Something,
}

/// How a wrist or fingers stand to their target.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum HandState {
    /// There: a wrist within 5 mm and 0.05 rad, or of a hand that holds something, under which its arm sags, within 15 mm and 0.15 rad;
    /// every finger joint within 0.06 rad.
    Arrived,
    /// A wrist without a target, whose arm keeps its joints as it was told to.
    Idle,
    /// Coming nearer.
    Moving,
    /// Stopped short by load or contact: fingers around an object are, and an arm that was pushed away.
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
    /// Joint angles that were asked for, in radians. Left out of a short reply.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target_rad: Option<[f64; 7]>,
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
