//! Conversion of numeric actions to the robots' commands.

use std::ops::Range;

use tandem_sim::{HAND_COLUMNS, HAND_JOINTS, RobotCommand, RobotModel, UPPER};
use tandem_tools_spec::{
    ACTION_ROW_LEN, ActCall, BASE_COLUMNS, JointChunk, MoveWrists, SendJointChunk, WristMove,
};

use super::column::{RowColumn, joint_column};
use crate::commands::base_row;

/// Number of values of a wrist's pose: x, y, z (m), then w, x, y, z.
const POSE: usize = 7;
const FINGERS: usize = HAND_JOINTS;
const WRIST_ROW_LEN: usize = 2 * POSE + 2 * FINGERS + BASE_COLUMNS.len();
/// Limit of a wrist's distance from the pelvis. No hand of a standing robot reaches farther.
const REACH_M: f32 = 1.0;

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

    /// Returns the number of values of a robot's row.
    pub fn row_len(self) -> usize {
        match self {
            ActionKind::Joints => ACTION_ROW_LEN,
            ActionKind::Wrists => WRIST_ROW_LEN,
        }
    }

    /// Returns the columns before the base command.
    pub(super) fn columns(self, model: &RobotModel) -> Vec<RowColumn> {
        let joints = |columns: Range<usize>| UPPER[columns].iter().map(|joint| joint_column(model, *joint));
        match self {
            ActionKind::Joints => joints(0..UPPER.len()).collect(),
            ActionKind::Wrists => {
                let first = HAND_COLUMNS.left;
                pose_columns().chain(joints(first..first + 2 * FINGERS)).collect()
            }
        }
    }

    /// Returns the call that carries out a world's rows, one for each robot, in `steps` control steps.
    ///
    /// before_rows: Joint rows of the commands in force, from which joint targets start.
    pub fn call<'a>(
        self,
        robots: impl Iterator<Item = &'a str>,
        row: &[f32],
        before_rows: &[Vec<f64>],
        steps: u32,
    ) -> ActCall {
        let rows = robots.zip(row.chunks_exact(self.row_len()));
        match self {
            ActionKind::Joints => {
                let chunk = |((robot, row), before_row): ((&str, &[f32]), &Vec<f64>)| {
                    let goal: Vec<f64> = row.iter().copied().map(f64::from).collect();
                    let share = |step| f64::from(step) / f64::from(steps);
                    let rows = (1..=steps).map(|step| between_rows(before_row, &goal, share(step))).collect();
                    JointChunk { robot: robot.into(), rows }
                };
                ActCall::SendJointChunk(SendJointChunk { robots: rows.zip(before_rows).map(chunk).collect() })
            }
            ActionKind::Wrists => {
                let robots = rows.map(|(robot, row)| wrist_move(robot, row)).collect();
                ActCall::MoveWrists(MoveWrists { steps, robots })
            }
        }
    }
}

/// Returns a command as a row of [`ActionKind::Joints`].
pub fn joint_row(command: &RobotCommand) -> Vec<f64> {
    command.upper_rad.into_iter().chain(base_row(&command.base)).map(f64::from).collect()
}

/// Returns the columns of a joint row that are velocities rather than positions.
pub fn velocities() -> Range<usize> {
    UPPER.len()..ACTION_ROW_LEN - 1
}

/// Interpolates between two joint rows at the fraction `share`. Velocities are those of the goal
/// throughout, because they are not positions.
pub fn between_rows(before_row: &[f64], goal_row: &[f64], share: f64) -> Vec<f64> {
    let value = |(column, (before, goal)): (usize, (&f64, &f64))| match velocities().contains(&column) {
        true => *goal,
        // Returns the goal exactly, to the last bit.
        false if share == 1.0 => *goal,
        false => before + (goal - before) * share,
    };
    before_row.iter().zip(goal_row).enumerate().map(value).collect()
}

/// Yields the columns of both wrists' poses in the pelvis frame.
fn pose_columns() -> impl Iterator<Item = RowColumn> {
    let parts = [
        ("x_m", "m", REACH_M),
        ("y_m", "m", REACH_M),
        ("z_m", "m", REACH_M),
        ("qw", "1", 1.0),
        ("qx", "1", 1.0),
        ("qy", "1", 1.0),
        ("qz", "1", 1.0),
    ];
    ["left", "right"].into_iter().flat_map(move |side| {
        parts.map(|(part, unit, limit)| RowColumn {
            name: format!("{side}_wrist_{part}"),
            unit,
            min: -limit,
            max: limit,
        })
    })
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
