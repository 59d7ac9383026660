//! Worlds for tests, constructed by hand, and the quantities of such worlds.

use std::sync::LazyLock;

use tandem_sim::{ObjectModel, ObjectPart, Rotation};

use super::*;
use crate::spec::RobotFile;
use crate::tasks::{self, RobotSpot, Task};

/// Model of all robots.
static ROBOT: LazyLock<Arc<RobotModel>> = LazyLock::new(|| RobotFile::default().model().unwrap());

impl Facts {
    /// Returns the facts with every robot and object at its spot, at rest, and no object touched since the
    /// episode began 10 s ago.
    pub fn at_rest(task: &Task) -> Facts {
        let robot = |spot: &RobotSpot| RobotFacts {
            model: ROBOT.clone(),
            world_from_link: standing(spot.position_m, spot.yaw_rad),
            pelvis_in_world: standing(spot.position_m, spot.yaw_rad)[0],
            wrist_in_pelvis: Sides::both(Pose::IDENTITY),
            hand_force_n: Sides::both(Vector::ZERO),
            fallen: false,
        };
        let part = |world_from_object: Pose, part: ObjectPart| {
            let pose_in_world = world_from_object * part.object_from_part;
            ObjectFacts {
                opened_value: part.model.opening.as_ref().map(|_| 0.0),
                name: part.name,
                model: part.model.into(),
                pose_in_world,
                velocity_m_s: Vector::ZERO,
                angular_velocity_rad_s: Vector::ZERO,
                rest_height_m: pose_in_world.translation.z,
                hands: vec![Sides::both(Grip::Off); task.robots.len()],
                untouched_s: 10.0,
            }
        };
        let object = |spot: &crate::tasks::ObjectSpot| {
            let heading = Rotation::from_rotation_z(spot.yaw_rad);
            let world_from_object = Pose::from_parts(spot.position_m.into(), heading);
            let parts = ObjectModel::parts(&spot.source, &spot.name).unwrap();
            parts.into_iter().map(move |found| part(world_from_object, found))
        };
        Facts {
            time_s: 10.0,
            robots: task.robots.iter().map(robot).collect(),
            objects: task.objects.iter().flat_map(object).collect(),
        }
    }

    /// Returns the same facts, except that these robots hold `object`, each with both hands.
    pub fn held_by(self, robots: &[usize], object: &str) -> Facts {
        let hands = robots.iter().flat_map(|robot| Side::BOTH.map(|side| (*robot, side)));
        hands.fold(self, |facts, (robot, side)| facts.grip(robot, side, object, Grip::Holding))
    }

    /// Returns the same facts, except that a robot has moved, with its posture unchanged.
    pub fn with_robot_moved(mut self, robot: usize, by_m: Vector) -> Facts {
        let robot = &mut self.robots[robot];
        robot.pelvis_in_world.translation += by_m;
        robot.world_from_link.iter_mut().for_each(|link| link.translation += by_m);
        self
    }

    pub fn object_mut(&mut self, name: &str) -> &mut ObjectFacts {
        self.objects.iter_mut().find(|object| object.name == name).unwrap()
    }

    pub fn grip(mut self, robot: usize, side: Side, object: &str, grip: Grip) -> Facts {
        let object = self.object_mut(object);
        object.hands[robot][side] = grip;
        object.untouched_s = 0.0;
        self
    }

    pub fn raised(mut self, object: &str, by_m: f32) -> Facts {
        self.object_mut(object).pose_in_world.translation.z += by_m;
        self
    }

    pub fn turned(mut self, object: &str, axis: Vector, angle_rad: f32) -> Facts {
        let turn = Rotation::from_axis_angle(axis, angle_rad);
        self.object_mut(object).pose_in_world.rotation = turn;
        self
    }
}

/// Returns the link poses of a robot in its file's rest posture, with its soles on the floor.
fn standing([x_m, y_m]: [f32; 2], yaw_rad: f32) -> Vec<Pose> {
    let q_rad: Vec<f32> = ROBOT.joints.iter().map(|joint| joint.rest_rad).collect();
    let heading = Rotation::from_rotation_z(yaw_rad);
    let above_floor = |height_m: f32| {
        let pelvis = Pose::from_parts(Vector::new(x_m, y_m, height_m), heading);
        ROBOT.forward_kinematics(pelvis, &q_rad)
    };
    let lowest_m = -ROBOT.reach_m(&above_floor(0.0), Vector::NEG_Z);
    above_floor(-lowest_m)
}

#[test]
fn quantities_are_those_of_the_constructed_world() {
    let handover = tasks::find("handover").unwrap();
    let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
    let rest = Facts::at_rest(&handover);
    assert!(close(rest.lift_m("bottle"), 0.0) && close(rest.tilt_rad("bottle"), 0.0));
    assert!(close(rest.clone().raised("bottle", 0.07).lift_m("bottle"), 0.07));
    for (axis, angle_rad, tilt_rad) in
        [(Vector::X, 0.4, 0.4), (Vector::Y, -0.4, 0.4), (Vector::X, 3.0, 3.0), (Vector::Z, 2.0, 0.0)]
    {
        let turned = rest.clone().turned("bottle", axis, angle_rad);
        assert!((turned.tilt_rad("bottle") - tilt_rad).abs() < 1e-3, "{axis} {angle_rad}");
    }
}

#[test]
fn bodies_reach_as_far_as_their_shapes() {
    let close = |a: f32, b: f32| (a - b).abs() < 1e-4;
    let rest = Facts::at_rest(&tasks::find("handover").unwrap());
    // The bottle is 70 mm thick and 0.30 m tall, and stands on the counter of 0.80 m at x = 0.30 m.
    assert!(
        close(rest.reach_m("bottle", Vector::X), 0.335)
            && close(rest.reach_m("bottle", Vector::NEG_X), -0.265)
    );
    assert!(close(rest.lowest_m("bottle"), 0.8) && close(rest.highest_m("bottle"), 1.1));
    let tilted = rest.clone().turned("bottle", Vector::Y, std::f32::consts::FRAC_PI_2);
    assert!(close(tilted.lowest_m("bottle"), 0.765) && close(tilted.clearance_m("bottle"), -0.035));
    // A is at 0 and looks along x. Its soles are on the floor, and its fingers are the foremost part.
    assert!(close(rest.robot_reach_m(A, Vector::NEG_Z), 0.0));
    let back_m = rest.robot_reach_m(A, Vector::NEG_X);
    let front_m = rest.robot_reach_m(A, Vector::X);
    assert!((0.08..0.16).contains(&back_m) && (0.25..0.6).contains(&front_m), "{back_m} {front_m}");
    let ahead = rest.with_robot_moved(A, Vector::X);
    assert!(close(ahead.robot_reach_m(A, Vector::NEG_X), back_m - 1.0));
}

#[test]
fn a_hold_is_of_one_hand_and_a_touch_is_no_hold() {
    use Side::{Left, Right};
    let rest = Facts::at_rest(&tasks::find("handover").unwrap());
    assert!(rest.hands_off(A, "bottle") && !rest.holds_any(A, "bottle"));
    let held = rest.clone().grip(A, Right, "bottle", Grip::Holding);
    assert!(held.holds(A, Right, "bottle") && held.holds_any(A, "bottle") && !held.hands_off(A, "bottle"));
    assert!(!held.holds(A, Left, "bottle") && !held.holds(B, Right, "bottle") && held.hands_off(B, "bottle"));
    let touched = rest.grip(A, Right, "bottle", Grip::Touching);
    assert!(!touched.holds_any(A, "bottle") && !touched.hands_off(A, "bottle"));
}

#[test]
#[should_panic(expected = "name \"vase\"")]
fn a_condition_on_something_that_is_not_there_is_a_bug() {
    Facts::at_rest(&tasks::find("handover").unwrap()).lift_m("vase");
}
