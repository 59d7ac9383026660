//! Conversion of numeric actions to the robots' commands.

use tandem_sim::{BaseLimits, RobotModel, UPPER};
use tandem_tools_spec::{
    ACTION_ROW_LEN, ActCall, BASE_COLUMNS, JointChunk, MoveWrists, SendJointChunk, WristMove,
};

/// Number of values of a wrist's pose: x, y, z (m), then w, x, y, z.
const POSE: usize = 7;
const FINGERS: usize = 7;
const WRIST_ROW_LEN: usize = 2 * POSE + 2 * FINGERS + 4;
/// Limit of a wrist's distance from the pelvis, and of a finger joint's angle (`FINGER_RAD`). No hand of a
/// standing robot reaches farther.
const REACH_M: f32 = 1.0;
const FINGER_RAD: f32 = 2.0;

/// Meaning of an action's row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ActionKind {
    /// A row of `send_joint_chunk`: 31 joint targets and the base command.
    Joints,
    /// The input of `move_wrists` for one control step: both wrists' poses in the pelvis frame, both hands'
    /// fingers, and the base command.
    Wrists,
}

impl ActionKind {
    pub const ALL: [ActionKind; 2] = [ActionKind::Joints, ActionKind::Wrists];

    pub fn name(self) -> &'static str {
        match self {
            ActionKind::Joints => "joints",
            ActionKind::Wrists => "wrists",
        }
    }

    /// Returns the number of columns of a robot's row.
    pub fn columns(self) -> usize {
        match self {
            ActionKind::Joints => ACTION_ROW_LEN,
            ActionKind::Wrists => WRIST_ROW_LEN,
        }
    }

    /// Returns the lower and upper limit of each number of a robot's row.
    pub fn limits(self, model: &RobotModel, base: &BaseLimits) -> Vec<[f32; 2]> {
        let BaseLimits { vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m } = *base;
        let mut limits: Vec<[f32; 2]> = match self {
            ActionKind::Joints => {
                let joints = UPPER.iter().map(|joint| &model.joints[*joint]);
                joints.map(|joint| [joint.lower_rad, joint.upper_rad]).collect()
            }
            ActionKind::Wrists => {
                let pose: [[f32; 2]; POSE] =
                    std::array::from_fn(|part| if part < 3 { [-REACH_M, REACH_M] } else { [-1.0, 1.0] });
                let fingers = [[-FINGER_RAD, FINGER_RAD]; 2 * FINGERS];
                [pose, pose].concat().into_iter().chain(fingers).collect()
            }
        };
        limits.extend([vx_m_s, vy_m_s, yaw_rate_rad_s, pelvis_height_m]);
        limits
    }

    /// Returns the call of one control step from a world's rows, one for each robot.
    pub fn call<'a>(self, robots: impl Iterator<Item = &'a str>, row: &[f32]) -> ActCall {
        let rows = robots.zip(row.chunks_exact(self.columns()));
        match self {
            ActionKind::Joints => {
                let chunk = |(robot, row): (&str, &[f32])| JointChunk {
                    robot: robot.into(),
                    rows: vec![row.iter().copied().map(f64::from).collect()],
                };
                ActCall::SendJointChunk(SendJointChunk { robots: rows.map(chunk).collect() })
            }
            ActionKind::Wrists => {
                let robots = rows.map(|(robot, row)| wrist_move(robot, row)).collect();
                ActCall::MoveWrists(MoveWrists { steps: 1, robots })
            }
        }
    }
}

/// Returns the names of the columns of [`ActionKind::Wrists`].
pub fn wrist_columns() -> Vec<String> {
    let sides = ["left", "right"];
    let pose = sides.iter().flat_map(|side| {
        ["x_m", "y_m", "z_m", "qw", "qx", "qy", "qz"].map(|part| format!("{side}_wrist_{part}"))
    });
    let fingers = sides.iter().flat_map(|side| {
        ["thumb_0", "thumb_1", "thumb_2", "middle_0", "middle_1", "index_0", "index_1"]
            .map(|finger| format!("{side}_{finger}_rad"))
    });
    pose.chain(fingers).chain(BASE_COLUMNS.map(String::from)).collect()
}

fn wrist_move(robot: &str, row: &[f32]) -> WristMove {
    let number = |column: usize| f64::from(row[column]);
    let position_m = |first: usize| Some(std::array::from_fn(|axis| number(first + axis)));
    let quaternion = |first: usize| Some(std::array::from_fn(|part| number(first + 3 + part)));
    let fingers_rad = |first: usize| Some(std::array::from_fn(|finger| number(first + finger)));
    let [left, right, left_fingers, right_fingers, base] =
        [0, POSE, 2 * POSE, 2 * POSE + FINGERS, 2 * POSE + 2 * FINGERS];
    WristMove {
        left_position_m: position_m(left),
        left_quaternion_wxyz: quaternion(left),
        right_position_m: position_m(right),
        right_quaternion_wxyz: quaternion(right),
        left_fingers_rad: fingers_rad(left_fingers),
        right_fingers_rad: fingers_rad(right_fingers),
        vx_m_s: Some(number(base)),
        vy_m_s: Some(number(base + 1)),
        yaw_rate_rad_s: Some(number(base + 2)),
        pelvis_height_m: Some(number(base + 3)),
        ..WristMove::hold(robot)
    }
}
