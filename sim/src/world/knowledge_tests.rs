//! Tests that only sensed values reach a robot's controller, its hands' frames and its replies.

use rapier3d::math::{Pose, Rotation, Vector};

use super::{RobotStep, World, WorldSpec};
use crate::BaseCommand;
use crate::body::UPPER;
use crate::plane::heading_rad;
use crate::robot::{RobotCommand, RobotPlacement, Sensing, SensorModel, StateSource};

const PLACE_M: [f32; 2] = [40.0, -30.0];
const YAW_RAD: f32 = 1.6;

/// Creates a world with a robot at this place. Its estimate starts at the origin instead, looking along x.
fn misled(position_m: [f32; 2], yaw_rad: f32, sensing: Sensing) -> World {
    let robot = RobotPlacement { name: "A".into(), position_m, yaw_rad };
    let mut world =
        World::new(&WorldSpec { scene: "floor".into(), robots: vec![robot], objects: vec![] }).unwrap();
    let truth = world.present().robots[0].truth.world_from_pelvis();
    let told = Pose::from_translation(Vector::Z * truth.translation.z);
    world.robots[0].set_sensing(&world.dynamics, &told, sensing, 7);
    world
}

/// Walks a curve with a moving arm and a small backward pull on one hand. Returns the steps.
fn walk(world: &mut World) -> Vec<RobotStep> {
    let rest = world.rest_command(0);
    let base = BaseCommand { vx_m_s: 0.3, yaw_rate_rad_s: 0.2, ..rest.base };
    let link = world.robots()[0].model.links[world.robots()[0].model.hands.left.wrist].name.clone();
    let mut command = RobotCommand { base, ..rest };
    let mut steps = Vec::new();
    for _ in 0..100 {
        command.upper_rad[0] -= 0.004;
        let ahead = world.present().robots[0].truth.world_from_pelvis().rotation * Vector::X;
        world.push(0, &link, Vector::ZERO, ahead * -5.0);
        steps.push(world.control_step(&[command]).unwrap().robots.remove(0));
    }
    steps
}

fn apart(a: &Pose, b: &Pose) -> f32 {
    (a.translation - b.translation).length() + 2.0 * (a.rotation.inverse() * b.rotation).xyz().length()
}

/// Position and heading in the world have no effect on a robot's actions, estimates and replies. Two robots
/// with the same initial estimate act alike, 50 m apart and with different headings. The remaining difference
/// is rounding that grows on two legs.
#[test]
fn where_the_world_is_reaches_no_robot() {
    for sensors in SensorModel::ALL {
        let sensing = Sensing { state_estimate: StateSource::Estimator, sensors };
        let here = walk(&mut misled([0.0; 2], 0.0, sensing));
        let there = walk(&mut misled(PLACE_M, YAW_RAD, sensing));
        for (a, b) in here.iter().zip(&there) {
            assert!(apart(&a.estimate.world_from_pelvis, &b.estimate.world_from_pelvis) < 0.01);
            assert!(apart(&a.sensed.start_from_pelvis, &b.sensed.start_from_pelvis) < 0.01);
            for (a, b) in a.sensed.joints.q_rad.iter().zip(&b.sensed.joints.q_rad) {
                assert!((a - b).abs() < 0.02, "{sensors:?}: {a} {b}");
            }
        }
        let (last, there) = (here.last().unwrap(), there.last().unwrap());
        let world_from_told =
            Pose::from_parts(Vector::new(PLACE_M[0], PLACE_M[1], 0.0), Rotation::from_rotation_z(YAW_RAD));
        let walked_m = last.sensed.start_from_pelvis.translation.truncate().length();
        assert!(walked_m > 0.2, "{walked_m}");
        // The error of the estimate is exactly that of the initial estimate.
        assert!(
            apart(&(world_from_told * there.estimate.world_from_pelvis), &there.truth.world_from_pelvis())
                < 0.05
        );
    }
}

/// With the simulator's state as source, the robot's estimate is its true pose, for any initial estimate.
#[test]
fn the_simulators_state_is_not_misled() {
    let mut world = misled(PLACE_M, YAW_RAD, Sensing::TRUTH);
    let step = walk(&mut world).pop().unwrap();
    let believed = step.estimate.world_from_pelvis;
    assert!(apart(&believed, &step.truth.world_from_pelvis()) < 1e-4);
    assert!(believed.translation.truncate().length() > 40.0 && heading_rad(&believed) > 1.0);
}

/// The command that keeps a robot in its present state follows from its readings and its estimate of its
/// pelvis.
#[test]
fn a_robot_stays_as_it_senses_itself() {
    let mut world = misled([0.0; 2], 0.0, Sensing::default());
    let rest_rad = world.robots[0].model.rest_rad();
    let ideal = world.rest_command(0);
    let standing_m = world.present().robots[0].truth.world_from_pelvis().translation.z;
    assert!((ideal.base.pelvis_height_m - standing_m).abs() < 1e-5);
    for (told_rad, joint) in ideal.upper_rad.iter().zip(UPPER) {
        assert!((told_rad - rest_rad[joint]).abs() < 1e-6, "exact sensors let nothing jump");
    }

    let told = Pose::from_translation(Vector::Z * 0.7);
    let sensing = Sensing { sensors: SensorModel::G1, ..Sensing::default() };
    world.robots[0].set_sensing(&world.dynamics, &told, sensing, 7);
    let noisy = world.rest_command(0);
    assert!((noisy.base.pelvis_height_m - 0.7).abs() < 0.01, "{}", noisy.base.pelvis_height_m);
    let read_rad = world.present().robots[0].sensed.joints.q_rad;
    for (told_rad, joint) in noisy.upper_rad.iter().zip(UPPER) {
        assert!((told_rad - read_rad[joint]).abs() < 1e-3);
    }
    assert_ne!(noisy.upper_rad, ideal.upper_rad);
}
