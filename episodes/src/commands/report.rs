//! How a robot did under an order that has just been executed.

use tandem_sim::{RobotState, Side, UPPER};
use tandem_tools_spec::{HandReport, RobotReport};

use super::Cut;
use super::columns;
use super::motion::{Motion, RobotSheet};
use crate::convert::{isometry_from_sim, rounded, wire_pose};

/// A measured joint this near to its limit rests at it.
const AT_LIMIT_RAD: f32 = 0.01;

/// What became of an order of which `cut` was cut down, where the robot measures `state` after it.
pub fn report(cut: &Cut, state: &RobotState, motion: &Motion) -> RobotReport {
    let robot = &motion.robot;
    RobotReport {
        robot: robot.name.clone(),
        left: hand_report(Side::Left, cut, state, motion),
        right: hand_report(Side::Right, cut, state, motion),
        waist_joints_clamped: names(robot, clamped(cut, |column| columns::waist().contains(&column))),
        waist_joints_at_limit: names(
            robot,
            columns::waist().filter(|column| at_limit(*column, robot, state)),
        ),
        base_command_clamped: cut.base.iter().map(|field| field.to_string()).collect(),
    }
}

fn hand_report(side: Side, cut: &Cut, state: &RobotState, motion: &Motion) -> HandReport {
    let (arm, hand) = (columns::arm(side), columns::hand(side));
    let target = motion.targets()[side];
    let measured = isometry_from_sim(&state.pelvis_from_wrist[side]);
    let missing = measured.inverse() * target;
    let robot = &motion.robot;
    HandReport {
        target: wire_pose(&target),
        measured: wire_pose(&measured),
        position_error_m: rounded(missing.translation.vector.norm()),
        orientation_error_rad: rounded(missing.rotation.angle()),
        joints_clamped: names(robot, clamped(cut, |column| arm.contains(&column) || hand.contains(&column))),
        // A finger is at a limit whenever the hand is open; that says nothing about reach.
        joints_at_limit: names(robot, arm.clone().filter(|column| at_limit(*column, robot, state))),
    }
}

fn clamped(cut: &Cut, of_interest: impl Fn(usize) -> bool) -> impl Iterator<Item = usize> {
    cut.columns.iter().copied().filter(move |column| of_interest(*column))
}

fn at_limit(column: usize, robot: &RobotSheet, state: &RobotState) -> bool {
    let joint = &robot.model.joints[UPPER[column]];
    let q_rad = state.q_rad[UPPER[column]];
    q_rad < joint.lower_rad + AT_LIMIT_RAD || q_rad > joint.upper_rad - AT_LIMIT_RAD
}

fn names(robot: &RobotSheet, columns: impl Iterator<Item = usize>) -> Vec<String> {
    columns.map(|column| robot.model.joints[UPPER[column]].name.clone()).collect()
}
