//! How one hand did: whether it is where it is to be, and what it feels.

use nalgebra::Isometry3;
use tandem_sim::{HAND_JOINTS, RobotState, Side, UPPER};
use tandem_tools_spec::{Effort, FingerReport, HandReport, HandState};

use super::{Cut, at_limit, clamped, columns, names};
use crate::commands::motion::Motion;
use crate::commands::upper_body::REACH_TOLERANCE;
use crate::convert::{isometry_from_sim, rounded, rounded_to, wire_pose};

/// An arm of which a joint turns faster is on the way; a finger likewise.
const ARM_MOVES_RAD_S: f32 = 0.05;
const FINGER_MOVES_RAD_S: f32 = 0.2;
/// Fingers that are free come this near to their targets.
const FINGER_TOLERANCE_RAD: f64 = 0.06;

pub fn report(side: Side, cut: &Cut, state: &RobotState, motion: &Motion) -> HandReport {
    let (arm, hand) = (columns::arm(side), columns::hand(side));
    let target = motion.targets()[side];
    let measured = isometry_from_sim(&state.pelvis_from_wrist[side]);
    let missing = measured.inverse() * target;
    let robot = &motion.robot;
    let force_n = state.world_from_pelvis.rotation.inverse() * state.hand_force_n[side];
    HandReport {
        state: wrist_state(side, &target, &measured, state, motion),
        target: wire_pose(&target),
        measured: wire_pose(&measured),
        position_error_m: rounded(missing.translation.vector.norm()),
        orientation_error_rad: rounded(missing.rotation.angle()),
        fingers: fingers(side, state, motion),
        largest_effort: largest_effort(side, state, motion),
        force_n: force_n.to_array().map(|part| rounded_to(2, part.into())),
        joints_clamped: names(robot, clamped(cut, |column| arm.contains(&column) || hand.contains(&column))),
        // A finger is at a limit whenever the hand is open; that says nothing about reach.
        joints_at_limit: names(robot, arm.clone().filter(|column| at_limit(*column, robot, state))),
    }
}

fn wrist_state(
    side: Side,
    target: &Isometry3<f64>,
    measured: &Isometry3<f64>,
    state: &RobotState,
    motion: &Motion,
) -> HandState {
    let commanded = motion.commanded_wrists()[side];
    if is_near(measured, target) {
        HandState::Arrived
    } else if columns::arm(side).any(|column| state.qd_rad_s[UPPER[column]].abs() > ARM_MOVES_RAD_S) {
        HandState::Moving
    } else if is_near(&commanded, target) {
        HandState::Blocked
    } else {
        HandState::OutOfReach
    }
}

fn is_near(wrist: &Isometry3<f64>, target: &Isometry3<f64>) -> bool {
    let missing = wrist.inv_mul(target);
    missing.translation.vector.norm() <= REACH_TOLERANCE.position_m
        && missing.rotation.angle() <= REACH_TOLERANCE.orientation_rad
}

fn fingers(side: Side, state: &RobotState, motion: &Motion) -> FingerReport {
    let first = columns::hand(side).start;
    let joint = |finger: usize| UPPER[first + finger];
    let target_rad: [f64; HAND_JOINTS] =
        std::array::from_fn(|finger| motion.state().upper_rad[first + finger]);
    let measured_rad: [f64; HAND_JOINTS] = std::array::from_fn(|finger| state.q_rad[joint(finger)].into());
    let near = |finger: usize| (target_rad[finger] - measured_rad[finger]).abs() <= FINGER_TOLERANCE_RAD;
    let moves = |finger: usize| state.qd_rad_s[joint(finger)].abs() > FINGER_MOVES_RAD_S;
    let state = if (0..HAND_JOINTS).all(near) {
        HandState::Arrived
    } else if (0..HAND_JOINTS).any(moves) {
        HandState::Moving
    } else {
        HandState::Blocked
    };
    let wire = |angles_rad: [f64; HAND_JOINTS]| angles_rad.map(|angle_rad| rounded_to(4, angle_rad));
    FingerReport { state, target_rad: wire(target_rad), measured_rad: wire(measured_rad) }
}

fn largest_effort(side: Side, state: &RobotState, motion: &Motion) -> Effort {
    let model = &motion.robot.model;
    let share = |joint: usize| state.torque_n_m[joint].abs() / model.joints[joint].effort_n_m;
    let joints = columns::arm(side).chain(columns::hand(side)).map(|column| UPPER[column]);
    let hardest = joints.max_by(|one, other| share(*one).total_cmp(&share(*other)));
    let hardest = hardest.unwrap_or(UPPER[columns::arm(side).start]);
    Effort { joint: model.joints[hardest].name.clone(), share: rounded_to(3, share(hardest).into()) }
}
