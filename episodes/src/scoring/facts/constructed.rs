//! Worlds for tests, put together by hand, and the quantities of such worlds.

use tandem_sim::{ObjectModel, ObjectPart};

use super::*;
use crate::tasks::{self, Task};

impl Facts {
    /// Every object at its spot, at rest and touched by no hand since the episode began 10 s ago.
    pub fn at_rest(task: &Task) -> Facts {
        let robot = |_| RobotFacts {
            pelvis_in_world: Pose::IDENTITY,
            wrist_in_pelvis: Sides::both(Pose::IDENTITY),
            hand_force_n: Sides::both(Vector::ZERO),
            fallen: false,
        };
        let part = |world_from_object: Pose, part: ObjectPart| {
            let pose_in_world = world_from_object * part.object_from_part;
            ObjectFacts {
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
            let heading = tandem_sim::Rotation::from_rotation_z(spot.yaw_rad);
            let world_from_object = Pose::from_parts(spot.position_m.into(), heading);
            let parts = ObjectModel::parts(spot.file, spot.name).unwrap();
            parts.into_iter().map(move |found| part(world_from_object, found))
        };
        Facts {
            time_s: 10.0,
            robots: task.robots.iter().map(robot).collect(),
            objects: task.objects.iter().flat_map(object).collect(),
        }
    }

    /// The same facts, but these robots hold `object`, each with both hands.
    pub fn held_by(self, robots: &[usize], object: &str) -> Facts {
        let hands = robots.iter().flat_map(|robot| Side::BOTH.map(|side| (*robot, side)));
        hands.fold(self, |facts, (robot, side)| facts.grip(robot, side, object, Grip::Holding))
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
        let turn = tandem_sim::Rotation::from_axis_angle(axis, angle_rad);
        self.object_mut(object).pose_in_world.rotation = turn;
        self
    }
}

#[test]
fn quantities_are_those_of_the_constructed_world() {
    let handover = tasks::find("handover").unwrap();
    let close = |a: f32, b: f32| (a - b).abs() < 1e-5;
    let rest = Facts::at_rest(handover);
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
fn a_hold_is_of_one_hand_and_a_touch_is_no_hold() {
    use Side::{Left, Right};
    let rest = Facts::at_rest(tasks::find("handover").unwrap());
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
    Facts::at_rest(tasks::find("handover").unwrap()).lift_m("vase");
}
