//! Frames of the live view: a control step as a row of little-endian f32 values. All rows of an episode
//! have the same length.
//!
//!   kind (1), control step, time [s], steps left, wall clock left [s] (-1 without a limit);
//!   for each robot the poses of its links, then for each object its pose;
//!   for each robot: 1 if it has fallen, its camera's pose, its base command (4), the values of `hand` for
//!   its left and its right hand, and for each joint the torque as a fraction of the effort limit.
//!
//! A pose is x, y, z [m] and the quaternion x, y, z, w, in the world frame.

use tandem_sim::{RobotStep, Side, Step};

use super::LiveStep;
use super::geometry::pose_row;
use crate::commands::{Motion, base_row, wrist_state};
use crate::convert::{isometry_from_sim, isometry_to_sim};
use tandem_tools_spec::HandState;

/// First value of the message of a step.
const STEP_KIND: f32 = 1.0;
const NO_LIMIT: f32 = -1.0;

/// Constants of a robot that the message of a step needs.
pub struct RobotFrame {
    pub name: String,
    pub effort_limits_n_m: Vec<f32>,
}

/// Returns the row of `live`. `motions` belong to the same robots, and are left in the state of the step.
pub fn row(live: &LiveStep, motions: &mut [Motion], robots: &[RobotFrame]) -> Vec<u8> {
    let LiveStep { step, budget, .. } = live;
    let steps_left = budget.as_ref().map_or(NO_LIMIT, |budget| budget.steps_left as f32);
    let clock_left = budget.as_ref().and_then(|budget| budget.wall_clock_left_s);
    let mut row = vec![
        STEP_KIND,
        step.control_step as f32,
        step.time_s as f32,
        steps_left,
        clock_left.map_or(NO_LIMIT, |left_s| left_s as f32),
    ];
    for robot in &step.robots {
        robot.truth.world_from_link.iter().for_each(|pose| row.extend(pose_row(pose)));
    }
    step.objects.iter().for_each(|object| row.extend(pose_row(&object.state.world_from_object)));
    for (index, robot) in step.robots.iter().enumerate() {
        let motion = &mut motions[index];
        motion.set_state(live.motions[index].clone());
        row.push(f32::from(robot.truth.fallen));
        row.extend(pose_row(&robot.truth.world_from_camera));
        row.extend(base_row(&robot.command.base));
        Side::BOTH.into_iter().for_each(|side| hand(step, index, side, motion, &mut row));
        let limits = robots[index].effort_limits_n_m.iter();
        row.extend(
            robot.sensed.joints.torque_n_m.iter().zip(limits).map(|(torque, limit)| torque.abs() / limit),
        );
    }
    row.into_iter().flat_map(f32::to_le_bytes).collect()
}

/// Appends the values of a hand: the wrist's pose (7), its target's pose (7), its state (1), and the errors
/// [m, rad]. Two forces follow: the force that the robot senses on the hand [N, world] (3), and the force
/// that objects exert on it [N, world] (3).
fn hand(step: &Step, index: usize, side: Side, motion: &Motion, row: &mut Vec<f32>) {
    let robot: &RobotStep = &step.robots[index];
    let world_from_wrist = robot.truth.world_from_wrist[side];
    row.extend(pose_row(&world_from_wrist));
    let wrist = motion.wrists()[side];
    // The robot aims in its estimated pelvis frame; the target is drawn in the true one.
    let world_from_target = robot.truth.world_from_pelvis() * isometry_to_sim(&wrist.yielded);
    row.extend(pose_row(&world_from_target));
    let measured = isometry_from_sim(&robot.sensed.pelvis_from_wrist[side]);
    let missing = measured.inverse() * wrist.yielded;
    row.push(match motion.aims_at_pose(side) {
        false => 0.0,
        true => state_number(wrist_state(side, &wrist, &measured, &robot.sensed, motion)),
    });
    row.push(missing.translation.vector.norm() as f32);
    row.push(missing.rotation.angle() as f32);
    row.extend(robot.hand_force_in_world_n()[side].to_array());
    let touches = step.touches.iter().filter(|touch| touch.robot == index && touch.side == side);
    // The contact forces act on the object; their negative acts on the hand.
    let exerted_n =
        touches.map(|touch| touch.contacts.thumb_n + touch.contacts.fingers_n + touch.contacts.palm_n);
    row.extend((-exerted_n.sum::<tandem_sim::Vector>()).to_array());
}

/// Returns the number of a state. A hand without a wrist target, which follows joint targets, has the number
/// 0, too.
fn state_number(state: HandState) -> f32 {
    match state {
        HandState::Idle => 0.0,
        HandState::Moving => 1.0,
        HandState::Arrived => 2.0,
        HandState::Blocked => 3.0,
        HandState::OutOfReach => 4.0,
    }
}
