//! `get_robot_state`: proprioception of one robot. `episodes/src/observation/proprioception.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::limits;
use crate::parts::{BaseCommand, JointValues, Pose, PoseFrame};
use crate::tool::Tool;

/// Read one robot's proprioception without an image: wrist poses in the pelvis frame, which way is down,
/// odometry, the base command in force and, unless `short`, 43 joint angles, velocities and torques. Costs
/// no steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("paper" = "Read one robot's proprioception: 43 joint angles by name, both wrist poses in the pelvis frame, and the \
    base command in force. Costs no steps."))]
#[serde(deny_unknown_fields)]
pub struct GetRobotState {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Frame of wrists; "room": also of pelvis.
    #[serde(default, skip_serializing_if = "PoseFrame::is_pelvis")]
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: PoseFrame,
}

impl GetRobotState {
    /// Returns the call for `robot`, with poses in the pelvis frame.
    pub fn of(robot: &str) -> GetRobotState {
        GetRobotState { robot: robot.into(), frame: PoseFrame::Pelvis }
    }
}

impl Tool for GetRobotState {
    type Reply = RobotState;
    const NAME: &'static str = "get_robot_state";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        GetRobotState::of("A")
    }

    fn robots(&self) -> Vec<&str> {
        vec![&self.robot]
    }
}

/// The reply to `get_robot_state`. A short one rounds poses to a millimetre and a thousandth.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RobotState {
    /// The robot, for example "A".
    pub robot: String,
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// Frame of the wrists, if the call named another than the pelvis; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<PoseFrame>,
    /// Joint angles in radians; left out of a short reply.
    #[serde(default, skip_serializing_if = "JointValues::is_empty")]
    pub joint_positions_rad: JointValues,
    /// Joint velocities in radians per second; left out of a short reply, and where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_velocities_rad_s: Option<JointValues>,
    /// Joint torques in newton metres, as the drives apply them; left out of a short reply, and where the
    /// assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub joint_torques_n_m: Option<JointValues>,
    /// Measured pose of the left wrist (`left_wrist_yaw_link`) in the pelvis frame (x forward, y left, z
    /// up), or in `frame`.
    pub left_wrist: Pose,
    /// Measured pose of the right wrist (`right_wrist_yaw_link`) in the same frame.
    pub right_wrist: Pose,
    /// Commanded pose of the left wrist in the same frame. Send it again to hold the hand: arms sag, and a
    /// hand that is repeatedly sent its measured pose sinks. Left out where the arm keeps its joints instead,
    /// and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub left_wrist_target: Option<Pose>,
    /// The same of the right wrist.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub right_wrist_target: Option<Pose>,
    /// The direction of gravity in the pelvis frame, length 1: [0, 0, -1] when upright. Left out of a short
    /// reply where it is within a hundredth of that, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gravity_in_pelvis: Option<[f64; 3]>,
    /// Pose of its pelvis in the start frame by its own IMU and joints. The start frame is on the floor under
    /// the pelvis at the start of the episode, z up, x along its heading. Drifts by up to 1 % of the distance
    /// walked. Left out of a short reply with `pelvis_in_room`, and where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_start: Option<Pose>,
    /// The same in the room frame, if the call named it; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pelvis_in_room: Option<Pose>,
    /// Base command in force; left out of a short reply where the robot stands as high as commanded.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub base_command: Option<BaseCommand>,
    /// True if the robot has fallen; left out of a short reply where it has not, and where the assistance is
    /// "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fallen: Option<bool>,
    /// Readings of its sensors in each physics step of the last control step, if the call requests
    /// `samples`; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<SensorSamples>,
}

/// Sensor readings of a robot every 5 ms. The last are at the reply's `time_s`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct SensorSamples {
    /// Angles of the 43 joints in radians, in the order of `joint_positions_rad`.
    pub joint_positions_rad: Vec<Vec<f64>>,
    /// Velocities of the joints in radians per second.
    pub joint_velocities_rad_s: Vec<Vec<f64>>,
    /// Torques of the joints in newton metres.
    pub joint_torques_n_m: Vec<Vec<f64>>,
    /// Angular velocities of the pelvis in its own frame, as its gyroscope measures them.
    pub gyro_rad_s: Vec<[f64; 3]>,
    /// Specific forces at the IMU in the pelvis frame, as its accelerometer measures them: 9.81 upwards at
    /// rest.
    pub specific_force_m_s2: Vec<[f64; 3]>,
}
