//! Tests of hand motion under a moving pelvis, by kinematics alone: joints are at their targets.

use std::f64::consts::FRAC_PI_2;
use std::sync::Arc;

use nalgebra::{Isometry3, Translation3, UnitQuaternion, Vector3};
use tandem_sim::{BaseCommand, BaseLimits, RobotCommand, RobotSource, Side, Sides, UPPER, assets};
use tandem_tools_spec::{MoveWrists, Protocol, ToolCall, WalkMove, WristMove};

use super::*;
use crate::commands::motion::Reach;
use crate::protocol::rules;
use crate::tasks;

/// Returns a robot called A that stands at rest with its pelvis 0.78 m above the world's origin.
fn standing() -> Motion {
    let source = RobotSource::embedded(assets::DEFAULT_ROBOT).unwrap();
    let model = Arc::new(source.model.clone());
    let base = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m: 0.78 };
    let rest = RobotCommand { upper_rad: UPPER.map(|joint| model.joints[joint].rest_rad), base };
    let body = Arc::new(UpperBody::new(&source, &rest).unwrap());
    let range = [-1.0, 1.0];
    let base_limits =
        BaseLimits { vx_m_s: range, vy_m_s: range, yaw_rate_rad_s: range, pelvis_height_m: range };
    let robot = RobotSheet { name: "A".into(), model, base_limits, start_from_room: Isometry3::identity() };
    Motion::new(robot, &body, &rest, Isometry3::translation(0.0, 0.0, 0.78))
}

/// Returns A's action for `entry`, in a command of 50 steps.
fn action(entry: WristMove, motion: &Motion) -> RobotAction {
    let rules = rules(Protocol::Benchmark, &tasks::find("handover").unwrap());
    let ToolCall::Act(call) = MoveWrists { steps: 50, robots: vec![entry] }.into() else { panic!("a look") };
    let command = Command::read(&call, &rules, std::slice::from_ref(motion)).unwrap();
    command.orders.into_iter().next().unwrap().action
}

/// Runs 50 steps, in each of which the pelvis moves by `pelvis_step_m`.
fn play(action: RobotAction, pelvis_step_m: Vector3<f64>, motion: &mut Motion) {
    play_pulled(action, pelvis_step_m, Vector3::zeros(), motion);
}

/// Runs steps like [`play`] with the total force `both_n` on the hands.
fn play_pulled(action: RobotAction, pelvis_step_m: Vector3<f64>, both_n: Vector3<f64>, motion: &mut Motion) {
    play_felt(action, pelvis_step_m, Sides::both(0.5 * both_n), motion);
}

/// Runs steps like [`play`] with a force on each hand.
fn play_felt(
    action: RobotAction,
    pelvis_step_m: Vector3<f64>,
    hands_n: Sides<Vector3<f64>>,
    motion: &mut Motion,
) {
    let (trajectory, _) = Trajectory::begin(&action, 50, motion);
    for step in 1..=50 {
        trajectory.command(step, motion);
        motion.sense(Translation3::from(pelvis_step_m) * motion.world_from_pelvis(), hands_n);
    }
}

fn right_hand(carried: bool) -> WristMove {
    WristMove {
        right_position_m: Some([0.28, -0.24, 0.22]),
        right_quaternion_wxyz: Some([1.0, 0.0, 0.0, 0.0]),
        carried: Some(carried),
        ..WristMove::hold("A")
    }
}

/// Returns the position of the right wrist under the commanded joints.
fn wrist_in_world_m(motion: &Motion) -> Vector3<f64> {
    (motion.world_from_pelvis() * motion.wrists().right.commanded).translation.vector
}

/// Returns a robot whose right hand has reached its target in front of its chest.
fn arrived() -> Motion {
    let mut motion = standing();
    let goal = action(right_hand(false), &motion);
    play(goal, Vector3::zeros(), &mut motion);
    play(RobotAction::Wait, Vector3::zeros(), &mut motion);
    motion
}

#[test]
fn a_hand_stays_in_the_world_under_a_moving_pelvis_until_it_is_out_of_reach() {
    let mut motion = arrived();
    let there_m = wrist_in_world_m(&motion);
    assert!((there_m - Vector3::new(0.28, -0.24, 1.0)).norm() < 1e-3, "{there_m}");
    let back = |distance_m: f64| Vector3::new(-distance_m / 50.0, 0.0, 0.0);
    for distance_m in [0.01, -0.02, 0.06] {
        play(RobotAction::Wait, back(distance_m), &mut motion);
        let off_m = (wrist_in_world_m(&motion) - there_m).norm();
        // Inverse kinematics lags two control steps behind the pelvis.
        assert!(off_m < 5e-3, "{off_m} m off after {distance_m} m back");
    }
    play(RobotAction::Wait, back(0.6), &mut motion);
    let off_m = (wrist_in_world_m(&motion) - there_m).norm();
    assert!(off_m > 0.1, "{off_m} m off, with the arm's length between pelvis and target");
}

#[test]
fn targets_are_of_the_pelvis_at_the_beginning_and_only_carried_ones_move_with_it() {
    let step_m = Vector3::new(0.001, 0.0005, 0.0);
    for (carried, walked) in [(false, 0.0), (true, 50.0)] {
        let mut motion = arrived();
        let began_m = wrist_in_world_m(&motion);
        let goal = action(right_hand(carried), &motion);
        play(goal, step_m, &mut motion);
        let off_m = (wrist_in_world_m(&motion) - began_m - walked * step_m).norm();
        assert!(off_m < 3e-3, "{off_m} m off with carried {carried}");
        // The current target is reported in the frame of the moved pelvis.
        let target_m = motion.wrists().right.yielded.translation.vector;
        let expected_m = Vector3::new(0.28, -0.24, 0.22) + (walked - 50.0) * step_m;
        assert!((target_m - expected_m).norm() < 1e-9, "{target_m} with carried {carried}");
    }
}

#[test]
fn hands_give_way_as_they_were_told_to_and_come_back() {
    let ahead_n = Vector3::new(10.0, 0.0, 0.0);
    let soft = || WristMove { compliance_n_s_m: Some(250.0), ..right_hand(false) };
    let mut motion = arrived();
    let there_m = wrist_in_world_m(&motion);
    let off_m = |motion: &Motion| wrist_in_world_m(motion) - there_m;
    // A pull on a stiff hand, or a sideways pull on a compliant one, does not move it.
    for (entry, hands_n) in [(right_hand(false), ahead_n), (soft(), Vector3::new(0.0, 30.0, -20.0))] {
        let goal = action(entry, &motion);
        play_pulled(goal, Vector3::zeros(), hands_n, &mut motion);
        assert!(off_m(&motion).norm() < 1e-3, "{} under {hands_n}", off_m(&motion));
        play(RobotAction::Wait, Vector3::zeros(), &mut motion);
    }
    // A force of 10 N acts for one second, with a compliance of 1 m/s per 250 N. The hand yields by 4 cm,
    // minus the creep back and the hand's lag.
    let goal = action(soft(), &motion);
    play_pulled(goal, Vector3::zeros(), ahead_n, &mut motion);
    assert!((0.036..0.040).contains(&off_m(&motion).x), "{}", off_m(&motion));
    // The next command starts at the hand's current place, and continues to the limit.
    let goal = action(soft(), &motion);
    play_pulled(goal, Vector3::zeros(), 3.0 * ahead_n, &mut motion);
    assert!((0.058..0.0605).contains(&off_m(&motion).x), "{}", off_m(&motion));
    play(RobotAction::Wait, Vector3::zeros(), &mut motion);
    play(RobotAction::Wait, Vector3::zeros(), &mut motion);
    assert!(off_m(&motion).norm() < 1e-3, "{}", off_m(&motion));
}

/// A hand with a new orientation and no position is to stay at its earlier target. A continual pull moves it
/// by no more than the limit of one command.
#[test]
fn targets_that_are_left_out_do_not_go_on_from_where_hands_have_given_way_to() {
    let mut motion = arrived();
    let there_m = wrist_in_world_m(&motion);
    for command in 0..6 {
        let position_m = right_hand(false).right_position_m.filter(|_| command == 0);
        let entry =
            WristMove { right_position_m: position_m, compliance_n_s_m: Some(250.0), ..right_hand(false) };
        let goal = action(entry, &motion);
        play_pulled(goal, Vector3::zeros(), Vector3::new(30.0, 0.0, 0.0), &mut motion);
        let off_m = (wrist_in_world_m(&motion) - there_m).norm();
        assert!((0.05..0.061).contains(&off_m), "{off_m} m after command {command}");
    }
}

/// Returns a robot that faces left with both hands in front of its chest, and the action for `soft` with
/// these targets.
fn both_hands(soft: WristMove) -> (Motion, RobotAction) {
    let mut motion = standing();
    let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), FRAC_PI_2);
    motion.sense(motion.world_from_pelvis() * turned, Sides::both(Vector3::zeros()));
    let ahead = Some([1.0, 0.0, 0.0, 0.0]);
    let entry = WristMove {
        left_position_m: Some([0.28, 0.24, 0.22]),
        left_quaternion_wxyz: ahead,
        right_position_m: Some([0.28, -0.24, 0.22]),
        right_quaternion_wxyz: ahead,
        ..soft
    };
    let stiff = WristMove { side_compliance_n_s_m: None, turn_compliance_n_m_s_rad: None, ..entry.clone() };
    let goal = action(stiff, &motion);
    play(goal, Vector3::zeros(), &mut motion);
    play(RobotAction::Wait, Vector3::zeros(), &mut motion);
    let soft = action(entry, &motion);
    (motion, soft)
}

fn wrists_in_world(motion: &Motion) -> Sides<Isometry3<f64>> {
    motion.wrists().map(|wrist| motion.world_from_pelvis() * wrist.commanded)
}

/// 10 N and 2 N m act for one second, with compliances of 1 m/s per 250 N and 1 rad/s per 20 N m. The hands
/// yield by 4 cm and 0.1 rad, minus the creep back and the hands' lag.
#[test]
fn the_pair_of_hands_gives_way_to_the_side_and_about_the_vertical() {
    // The robot faces along the world's y axis, so -x is its left, and its left hand is the one at -x.
    let to_left = Sides::both(Vector3::new(-5.0, 0.0, 0.0));
    let turning_n = 2.0 / 0.48;
    let turning =
        Sides { left: Vector3::new(0.0, -turning_n, 0.0), right: Vector3::new(0.0, turning_n, 0.0) };
    let side = || WristMove { side_compliance_n_s_m: Some(250.0), ..WristMove::hold("A") };
    let turn = || WristMove { turn_compliance_n_m_s_rad: Some(20.0), ..WristMove::hold("A") };
    for (soft, felt_n, left_m, turned_rad) in [
        (side(), to_left, 0.036..0.040, -0.002..0.002),
        (side(), turning, -0.001..0.001, -0.002..0.002),
        (turn(), turning, -0.001..0.001, 0.090..0.100),
        (turn(), to_left, -0.001..0.001, -0.002..0.002),
        (WristMove::hold("A"), turning, -0.001..0.001, -0.002..0.002),
    ] {
        let (mut motion, goal) = both_hands(soft);
        let before = wrists_in_world(&motion);
        play_felt(goal, Vector3::zeros(), felt_n, &mut motion);
        let after = wrists_in_world(&motion);
        let middle = |wrists: &Sides<Isometry3<f64>>| {
            0.5 * (wrists.left.translation.vector + wrists.right.translation.vector)
        };
        let moved_m = middle(&after) - middle(&before);
        assert!(left_m.contains(&-moved_m.x) && moved_m.y.abs() < 1e-3, "{moved_m}, not {left_m:?}");
        for side in Side::BOTH {
            let by = after[side].rotation * before[side].rotation.inverse();
            assert!(turned_rad.contains(&by.scaled_axis().z), "{side:?} turned by {}", by.scaled_axis());
        }
        let apart_m = after.left.translation.vector - after.right.translation.vector;
        assert!((apart_m.norm() - 0.48).abs() < 2e-3, "hands {} m apart", apart_m.norm());
        // The next command starts at the hands' current places; without compliance they return.
        let (trajectory, _) = Trajectory::begin(&RobotAction::Wait, 50, &mut motion);
        trajectory.command(1, &mut motion);
        let next = wrists_in_world(&motion);
        assert!((middle(&next) - middle(&after)).norm() < 5e-3);
        play(RobotAction::Wait, Vector3::zeros(), &mut motion);
        play(RobotAction::Wait, Vector3::zeros(), &mut motion);
        let back = wrists_in_world(&motion);
        for side in Side::BOTH {
            let off_m = (back[side].translation.vector - before[side].translation.vector).norm();
            assert!(off_m < 1e-3, "{side:?} is {off_m} m from where it was told to be");
        }
    }
}

#[test]
fn an_arm_without_a_target_keeps_its_joints() {
    let mut motion = arrived();
    let left = columns::arm(Side::Left);
    let before_rad = motion.state().upper_rad;
    let low = WristMove { right_position_m: Some([0.30, -0.10, -0.05]), ..WristMove::hold("A") };
    let goal = action(low, &motion);
    play(goal, Vector3::new(0.001, 0.0, 0.0), &mut motion);
    let after_rad = motion.state().upper_rad;
    assert_eq!(after_rad[left.clone()], before_rad[left], "the left arm was given no target");
    assert_ne!(after_rad[columns::arm(Side::Right)], before_rad[columns::arm(Side::Right)]);

    // Walking moves both arms with the pelvis, whatever their earlier targets.
    let mut walking = arrived();
    let walk = WalkMove {
        robot: "A".into(),
        vx_m_s: 0.0,
        vy_m_s: 0.0,
        yaw_rate_rad_s: 0.0,
        pelvis_height_m: None,
        waist_yaw_rad: None,
        look_at_m: None,
    };
    play(RobotAction::Walk(walk), Vector3::new(0.002, 0.0, 0.0), &mut walking);
    assert_eq!(walking.state().upper_rad, before_rad);
}

#[test]
fn reach_is_asked_of_the_named_arm_alone() {
    let motion = standing();
    for (x_m, within) in [(0.3, true), (0.9, false)] {
        let pose = Isometry3::translation(x_m, -0.2, 0.1);
        let Reach { errors, joints_at_limit: at_limit, .. } =
            motion.reach(&Sides { left: None, right: Some(pose) }, false);
        assert!(errors.left.is_none());
        assert_eq!(errors.right.unwrap().position_m < 0.005, within);
        assert!(at_limit.iter().all(|joint| !joint.starts_with("left")), "{at_limit:?}");
    }
}

#[test]
fn a_half_that_is_left_out_is_where_the_hand_is_to_be() {
    let mut motion = arrived();
    let target = motion.wrists().right.yielded;
    let higher = WristMove { right_position_m: Some([0.28, -0.24, 0.3]), ..WristMove::hold("A") };
    play(action(higher, &motion), Vector3::zeros(), &mut motion);
    let moved = motion.wrists().right.yielded;
    assert!((moved.translation.vector - Vector3::new(0.28, -0.24, 0.3)).norm() < 1e-12);
    // The target is converted to the world frame and back; rounding to six decimals would be much coarser.
    assert!(moved.rotation.angle_to(&target.rotation) < 1e-12);
    let turned = WristMove { right_quaternion_wxyz: Some([0.8, 0.6, 0.0, 0.0]), ..WristMove::hold("A") };
    play(action(turned, &motion), Vector3::zeros(), &mut motion);
    let off_m = (motion.wrists().right.yielded.translation.vector - moved.translation.vector).norm();
    assert!(off_m < 1e-12, "{off_m} m");
}
