//! Reports on robots after an executed order.

mod feel;

use nalgebra::Isometry3;
use tandem_ik::Tolerance;
use tandem_sim::{HAND_JOINTS, Pose, RobotSensed, Side, UPPER, Vector};
use tandem_tools_spec::{
    BaseMotion, Effort, FingerReport, Grip, HandReport, HandState, Pose as WirePose, PoseFrame, RobotReport,
    Touch,
};

use feel::Felt;

use super::aim::{Aim, WristPoses};
use super::columns::{self, Clamped};
use super::motion::{Motion, RobotSheet};
use crate::convert::{coarse, coarse_pose, isometry_from_sim, rounded_to};

/// Maximum distance between a joint's measured angle and its limit at which the joint counts as resting at
/// the limit.
const AT_LIMIT_RAD: f32 = 0.01;
/// Joint speeds above which an arm or a finger is moving.
const ARM_MOVES_RAD_S: f32 = 0.05;
const FINGER_MOVES_RAD_S: f32 = 0.2;
/// Displacement above which an arm without a wrist target has been pushed.
const PUSHED_AWAY_M: f64 = 0.03;
const PUSHED_AWAY_RAD: f64 = 0.15;
/// Factor on the arrival tolerance for a hand that presses on an object from two sides.
const HOLDING_FACTOR: f64 = 3.0;
/// Minimum force at which a blocked hand counts as touching an object.
const TOUCHED_N: f32 = 3.0;
/// Tolerance within which free fingers reach their targets.
const FINGER_TOLERANCE_RAD: f64 = 0.06;

/// Returns the grip of a hand, as sensed by the torques of its drives.
pub fn grip(side: Side, sensed: &RobotSensed, motion: &Motion) -> Grip {
    feel::felt(side, sensed, &motion.robot.model).grip
}

/// Returns the report on an order. `clamped` are its clamped values, `sensed` are the robot's readings after
/// the order, and `began` is the pelvis pose before the order by odometry. Wrist poses are in the frame of
/// the latest wrist targets.
pub fn report(clamped: &Clamped, began: &Pose, sensed: &RobotSensed, motion: &Motion) -> RobotReport {
    let (robot, frame) = (&motion.robot, motion.state().frame);
    RobotReport {
        robot: robot.name.clone(),
        frame: Some(frame).filter(|frame| *frame != PoseFrame::Pelvis),
        left: hand_report(Side::Left, clamped, sensed, motion, frame),
        right: hand_report(Side::Right, clamped, sensed, motion, frame),
        base: motion
            .setpoints()
            .is_empty()
            .then(|| motion.state().footing.report(&motion.state().base, motion.world_from_pelvis())),
        pelvis_in_start: Some(coarse_pose(&isometry_from_sim(&sensed.start_from_pelvis))),
        pelvis_in_room: pelvis_in_room(frame, motion),
        base_motion: Some(base_motion(began, &sensed.start_from_pelvis)),
        waist_joints_clamped: names(
            robot,
            among(&clamped.columns, |column| columns::waist().contains(&column)),
        ),
        waist_joints_at_limit: names(
            robot,
            columns::waist().filter(|column| at_limit(*column, robot, sensed)),
        ),
        base_command_clamped: clamped.base.iter().map(|field| field.to_string()).collect(),
    }
}

fn base_motion(began: &Pose, ended: &Pose) -> BaseMotion {
    let ahead = began.rotation * Vector::X;
    let ahead = Vector::new(ahead.x, ahead.y, 0.0).normalize_or(Vector::X);
    let moved_m = ended.translation - began.translation;
    let now_ahead = ended.rotation * Vector::X;
    let across = Vector::Z.cross(ahead);
    BaseMotion {
        forward_m: coarse(moved_m.dot(ahead).into()),
        left_m: coarse(moved_m.dot(across).into()),
        up_m: coarse(moved_m.z.into()),
        turned_rad: coarse(now_ahead.dot(across).atan2(now_ahead.dot(ahead)).into()),
    }
}

/// Returns the report on one hand.
fn hand_report(
    side: Side,
    clamped: &Clamped,
    sensed: &RobotSensed,
    motion: &Motion,
    frame: PoseFrame,
) -> HandReport {
    let (arm, hand) = (columns::arm(side), columns::hand(side));
    let wrist = motion.wrists()[side];
    let poses = wrist_poses(side, &wrist, sensed, motion);
    let ([target, measured], [wire_target, wire_measured]) = (poses, wire_wrists(poses, frame, motion));
    let missing = measured.inverse() * target;
    let offset_m = wrist.yielded.translation.vector - wrist.target.translation.vector;
    let robot = &motion.robot;
    let force_n = sensed.hand_force_in_pelvis_n[side];
    let state = wrist_state(side, &wrist, &measured, sensed, motion);
    let Felt { grip, presses, touch } = feel::felt(side, sensed, &robot.model);
    let is_pushed = state == HandState::Blocked && force_n.length() > TOUCHED_N;
    HandReport {
        state: Some(state),
        grip: Some(grip),
        presses,
        touches: touch.or(is_pushed.then_some(Touch::Something)),
        target: Some(wire_target),
        measured: Some(wire_measured),
        position_error_m: Some(coarse(missing.translation.vector.norm())),
        orientation_error_rad: Some(coarse(missing.rotation.angle())),
        given_way_m: (motion.aims_at_pose(side) && motion.has_yielded())
            .then(|| [offset_m.x, offset_m.y, offset_m.z].map(coarse)),
        fingers: Some(fingers(side, sensed, motion)),
        largest_effort: Some(largest_effort(side, sensed, motion)),
        force_n: Some(force_n.to_array().map(|part| rounded_to(1, part.into()))),
        joints_clamped: names(
            robot,
            among(&clamped.columns, |column| arm.contains(&column) || hand.contains(&column)),
        ),
        // A finger of an open hand is always at a limit, which is no information about reach.
        joints_at_limit: names(robot, arm.clone().filter(|column| at_limit(*column, robot, sensed))),
    }
}

/// Returns the target of a wrist and its measured pose, both in the pelvis frame; without a target, the
/// commanded pose. The yielding is reported separately; otherwise a repeated target would start from the
/// yielded pose.
fn wrist_poses(side: Side, wrist: &WristPoses, sensed: &RobotSensed, motion: &Motion) -> [Isometry3<f64>; 2] {
    let target = if motion.aims_at_pose(side) { wrist.target } else { wrist.commanded };
    [target, isometry_from_sim(&sensed.pelvis_from_wrist[side])]
}

/// Converts the target and the measured pose of a wrist to the report's poses in `frame`.
fn wire_wrists(poses: [Isometry3<f64>; 2], frame: PoseFrame, motion: &Motion) -> [WirePose; 2] {
    let frame_from_pelvis = motion.pelvis_from(frame).inverse();
    let [target, mut measured] = poses.map(|wrist| coarse_pose(&(frame_from_pelvis * wrist)));
    let signs = target.quaternion_wxyz.iter().zip(&measured.quaternion_wxyz);
    if signs.map(|(one, other)| one * other).sum::<f64>() < 0.0 {
        measured.quaternion_wxyz = measured.quaternion_wxyz.map(|part| 0.0 - part);
    }
    [target, measured]
}

fn pelvis_in_room(frame: PoseFrame, motion: &Motion) -> Option<WirePose> {
    (frame == PoseFrame::Room).then(|| coarse_pose(&motion.pelvis_from(frame).inverse()))
}

/// Converts the wrists of a report on the robot's present state to `frame`.
pub fn report_wrists_in(frame: PoseFrame, report: &mut RobotReport, sensed: &RobotSensed, motion: &Motion) {
    report.frame = Some(frame).filter(|frame| *frame != PoseFrame::Pelvis);
    report.pelvis_in_room = pelvis_in_room(frame, motion);
    let wrists = motion.wrists();
    for (side, hand) in [(Side::Left, &mut report.left), (Side::Right, &mut report.right)] {
        let poses = wrist_poses(side, &wrists[side], sensed, motion);
        let [target, measured] = wire_wrists(poses, frame, motion);
        (hand.target, hand.measured) = (Some(target), Some(measured));
    }
}

/// Returns the state of a wrist with these poses, which is at `measured` in the pelvis frame.
pub fn wrist_state(
    side: Side,
    wrist: &WristPoses,
    measured: &Isometry3<f64>,
    sensed: &RobotSensed,
    motion: &Motion,
) -> HandState {
    let target = &wrist.yielded;
    let turns =
        || columns::arm(side).any(|column| sensed.joints.qd_rad_s[UPPER[column]].abs() > ARM_MOVES_RAD_S);
    if motion.state().aims[side] == Aim::Joints {
        let missing = measured.inv_mul(target);
        let is_off =
            missing.translation.vector.norm() > PUSHED_AWAY_M || missing.rotation.angle() > PUSHED_AWAY_RAD;
        return match (is_off, turns()) {
            (false, _) => HandState::Idle,
            (true, true) => HandState::Moving,
            (true, false) => HandState::Blocked,
        };
    }
    let tolerance = motion.tolerance(side);
    let near = |factor: f64| is_near(measured, target, &tolerance, factor);
    // An arm sags under its load.
    if near(1.0) || (near(HOLDING_FACTOR) && grip(side, sensed, motion) == Grip::TwoSided) {
        HandState::Arrived
    } else if motion.comes_nearer(side).unwrap_or_else(turns) {
        HandState::Moving
    } else if is_near(&wrist.commanded, target, &tolerance, 1.0) {
        HandState::Blocked
    } else {
        HandState::OutOfReach
    }
}

/// Returns true if a wrist is within `factor` times the tolerance.
fn is_near(wrist: &Isometry3<f64>, target: &Isometry3<f64>, tolerance: &Tolerance, factor: f64) -> bool {
    let missing = wrist.inv_mul(target);
    missing.translation.vector.norm() <= factor * tolerance.position_m
        && missing.rotation.angle() <= factor * tolerance.orientation_rad
}

fn fingers(side: Side, sensed: &RobotSensed, motion: &Motion) -> FingerReport {
    let first = columns::hand(side).start;
    let joint = |finger: usize| UPPER[first + finger];
    let target_rad: [f64; HAND_JOINTS] =
        std::array::from_fn(|finger| motion.state().upper_rad[first + finger]);
    let measured_rad: [f64; HAND_JOINTS] =
        std::array::from_fn(|finger| sensed.joints.q_rad[joint(finger)].into());
    let near = |finger: usize| (target_rad[finger] - measured_rad[finger]).abs() <= FINGER_TOLERANCE_RAD;
    let moves = |finger: usize| sensed.joints.qd_rad_s[joint(finger)].abs() > FINGER_MOVES_RAD_S;
    let state = if (0..HAND_JOINTS).all(near) {
        HandState::Arrived
    } else if (0..HAND_JOINTS).any(moves) {
        HandState::Moving
    } else {
        HandState::Blocked
    };
    let wire = |angles_rad: [f64; HAND_JOINTS]| angles_rad.map(coarse);
    FingerReport { state: Some(state), target_rad: Some(wire(target_rad)), measured_rad: wire(measured_rad) }
}

fn largest_effort(side: Side, sensed: &RobotSensed, motion: &Motion) -> Effort {
    let model = &motion.robot.model;
    let share = |joint: usize| sensed.joints.torque_n_m[joint].abs() / model.joints[joint].effort_n_m;
    let joints = columns::arm(side).chain(columns::hand(side)).map(|column| UPPER[column]);
    let hardest = joints.max_by(|one, other| share(*one).total_cmp(&share(*other)));
    let hardest = hardest.unwrap_or(UPPER[columns::arm(side).start]);
    Effort { joint: model.joints[hardest].name.clone(), share: rounded_to(2, share(hardest).into()) }
}

fn among(columns: &[usize], of_interest: impl Fn(usize) -> bool) -> impl Iterator<Item = usize> {
    columns.iter().copied().filter(move |column| of_interest(*column))
}

fn at_limit(column: usize, robot: &RobotSheet, sensed: &RobotSensed) -> bool {
    let joint = &robot.model.joints[UPPER[column]];
    let q_rad = sensed.joints.q_rad[UPPER[column]];
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
