//! How a robot did under an order that has just been executed.

mod hand;

use tandem_sim::{Pose, RobotState, Side, UPPER, Vector};
use tandem_tools_spec::{BaseMotion, RobotReport};

use super::Cut;
use super::columns;
use super::motion::{Motion, RobotSheet};
use crate::convert::{rounded, wire_pose_from_sim};

/// A measured joint this near to its limit rests at it.
const AT_LIMIT_RAD: f32 = 0.01;

/// What became of an order of which `cut` was cut down, where the robot measures `state` after it; its own odometry had its
/// pelvis at `began` before.
pub fn report(cut: &Cut, began: &Pose, state: &RobotState, motion: &Motion) -> RobotReport {
    let robot = &motion.robot;
    RobotReport {
        robot: robot.name.clone(),
        left: hand::report(Side::Left, cut, state, motion),
        right: hand::report(Side::Right, cut, state, motion),
        pelvis_in_start: wire_pose_from_sim(&state.start_from_pelvis),
        base_motion: base_motion(began, &state.start_from_pelvis),
        waist_joints_clamped: names(robot, clamped(cut, |column| columns::waist().contains(&column))),
        waist_joints_at_limit: names(
            robot,
            columns::waist().filter(|column| at_limit(*column, robot, state)),
        ),
        base_command_clamped: cut.base.iter().map(|field| field.to_string()).collect(),
    }
}

fn base_motion(began: &Pose, ended: &Pose) -> BaseMotion {
    let ahead = began.rotation * Vector::X;
    let ahead = Vector::new(ahead.x, ahead.y, 0.0).normalize_or(Vector::X);
    let moved_m = ended.translation - began.translation;
    let now_ahead = ended.rotation * Vector::X;
    let across = Vector::Z.cross(ahead);
    BaseMotion {
        forward_m: rounded(moved_m.dot(ahead).into()),
        left_m: rounded(moved_m.dot(across).into()),
        up_m: rounded(moved_m.z.into()),
        turned_rad: rounded(now_ahead.dot(across).atan2(now_ahead.dot(ahead)).into()),
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

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use super::*;
    use tandem_sim::Rotation;

    #[test]
    fn the_base_moves_as_seen_from_where_it_began() {
        let at = |place_m: [f32; 3], heading_rad: f32| {
            Pose::from_parts(place_m.into(), Rotation::from_rotation_z(heading_rad))
        };
        let motion = base_motion(&at([1.0, 2.0, 0.75], FRAC_PI_2), &at([0.9, 2.3, 0.7], FRAC_PI_2 + 0.4));
        let found = [motion.forward_m, motion.left_m, motion.up_m, motion.turned_rad];
        for (found, expected) in found.into_iter().zip([0.3, 0.1, -0.05, 0.4]) {
            assert!((found - expected).abs() < 1e-5, "{motion:?}");
        }
    }
}
