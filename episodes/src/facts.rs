//! What scoring and the experts may know about the world. None of it is served to a policy.

use tandem_sim::{Pose, Side, Sides, Vector};

/// Index of robot A in [`Facts::robots`].
pub const A: usize = 0;
/// Index of robot B.
pub const B: usize = 1;

/// The world at one control step.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// One per robot, A first.
    pub robots: Vec<RobotFacts>,
    pub objects: Vec<ObjectFacts>,
}

/// One robot.
#[derive(Clone, Debug)]
pub struct RobotFacts {
    pub pelvis_in_world: Pose,
    pub wrist_in_pelvis: Sides<Pose>,
    /// Force of the world on each palm, in the world's frame; estimated from the arm's own torques. A hand that
    /// holds 0.5 kg still feels -4.9 N along z; one in quick motion feels its own inertia, too.
    pub hand_force_n: Sides<Vector>,
    pub fallen: bool,
}

/// One object and the hands on it.
#[derive(Clone, Debug)]
pub struct ObjectFacts {
    pub name: String,
    pub pose_in_world: Pose,
    pub velocity_m_s: Vector,
    pub angular_velocity_rad_s: Vector,
    /// Height of the object's origin above the floor when the episode began.
    pub rest_height_m: f32,
    /// Per robot: left hand, right hand.
    pub hands: Vec<[Grip; 2]>,
    /// For how long no hand has touched it.
    pub untouched_s: f64,
}

/// What a hand does to an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// No contact at all.
    Off,
    /// Contact, but not from two sides.
    Touching,
    /// The grasp detector is satisfied.
    Holding,
}

impl Facts {
    /// Whether this hand of this robot holds `object`.
    pub fn holds(&self, robot: usize, side: Side, object: &str) -> bool {
        self.object(object).hands[robot][side.index()] == Grip::Holding
    }

    /// Whether any hand of this robot holds `object`.
    pub fn holds_any(&self, robot: usize, object: &str) -> bool {
        self.object(object).hands[robot].contains(&Grip::Holding)
    }

    /// Whether neither hand of this robot touches `object`.
    pub fn hands_off(&self, robot: usize, object: &str) -> bool {
        self.object(object).hands[robot] == [Grip::Off; 2]
    }

    /// For how long no hand has touched `object`.
    pub fn untouched_s(&self, object: &str) -> f64 {
        self.object(object).untouched_s
    }

    /// How far the origin of `object` is above where it rested when the episode began.
    pub fn lift_m(&self, object: &str) -> f32 {
        let object = self.object(object);
        object.pose_in_world.translation.z - object.rest_height_m
    }

    /// Angle between the z axis of `object` and the world's.
    pub fn tilt_rad(&self, object: &str) -> f32 {
        let up_in_world = self.object(object).pose_in_world.rotation * Vector::Z;
        up_in_world.angle_between(Vector::Z)
    }

    pub fn speed_m_s(&self, object: &str) -> f32 {
        self.object(object).velocity_m_s.length()
    }

    pub fn turn_rate_rad_s(&self, object: &str) -> f32 {
        self.object(object).angular_velocity_rad_s.length()
    }

    /// World position of the origin of `object`.
    pub fn position_m(&self, object: &str) -> Vector {
        self.object(object).pose_in_world.translation
    }

    /// World position of a point fixed to `object`, given in its frame.
    pub fn point_m(&self, object: &str, point_in_object_m: Vector) -> Vector {
        self.object(object).pose_in_world * point_in_object_m
    }

    /// Whether the origin of `object` is inside an upright cylinder fixed to `container`: at most `radius_m` from its z axis,
    /// and between two heights above its origin.
    pub fn inside_cylinder(&self, object: &str, container: &str, radius_m: f32, heights_m: [f32; 2]) -> bool {
        let local = self.object(container).pose_in_world.inverse() * self.position_m(object);
        local.truncate().length() <= radius_m && (heights_m[0]..=heights_m[1]).contains(&local.z)
    }

    /// Whether the origin of `object` is inside a box fixed to `container`, given by its smallest and largest corner.
    pub fn inside_box(&self, object: &str, container: &str, low_m: Vector, high_m: Vector) -> bool {
        let local = self.object(container).pose_in_world.inverse() * self.position_m(object);
        local.cmpge(low_m).all() && local.cmple(high_m).all()
    }

    /// Whether a rod of `object`, from `ends_m[0]` to `ends_m[1]` in its frame, passes through a ring of `carrier`: a disc of
    /// `radius_m` around `centre_m`, with its axis along y, in the carrier's frame.
    pub fn threads(
        &self,
        object: &str,
        ends_m: [Vector; 2],
        carrier: &str,
        centre_m: Vector,
        radius_m: f32,
    ) -> bool {
        let carrier_from_object =
            self.object(carrier).pose_in_world.inverse() * self.object(object).pose_in_world;
        let [a, b] = ends_m.map(|end_m| carrier_from_object * end_m - centre_m);
        if a.y * b.y > 0.0 {
            return false;
        }
        let crossing = a + (b - a) * (a.y / (a.y - b.y));
        crossing.x.hypot(crossing.z) <= radius_m
    }

    /// Tasks name their own objects, so a name that is not there is a mistake in the task's file.
    pub fn object(&self, name: &str) -> &ObjectFacts {
        match self.objects.iter().find(|object| object.name == name) {
            Some(object) => object,
            None => panic!("the task's conditions name {name:?}, which its table of objects does not"),
        }
    }
}

/// Worlds for tests, put together by hand.
#[cfg(test)]
pub(crate) mod constructed {
    use super::*;
    use crate::tasks::Task;

    impl Facts {
        /// Every object at its spot, at rest and touched by no hand since the episode began 10 s ago.
        pub fn at_rest(task: &Task) -> Facts {
            let robot = |_| RobotFacts {
                pelvis_in_world: Pose::IDENTITY,
                wrist_in_pelvis: Sides::both(Pose::IDENTITY),
                hand_force_n: Sides::both(Vector::ZERO),
                fallen: false,
            };
            let object = |spot: &crate::tasks::ObjectSpot| ObjectFacts {
                name: spot.name.into(),
                pose_in_world: Pose::from_translation(spot.position_m.into()),
                velocity_m_s: Vector::ZERO,
                angular_velocity_rad_s: Vector::ZERO,
                rest_height_m: spot.position_m[2],
                hands: vec![[Grip::Off; 2]; task.robots.len()],
                untouched_s: 10.0,
            };
            Facts {
                time_s: 10.0,
                robots: task.robots.iter().map(robot).collect(),
                objects: task.objects.iter().map(object).collect(),
            }
        }

        pub fn object_mut(&mut self, name: &str) -> &mut ObjectFacts {
            self.objects.iter_mut().find(|object| object.name == name).unwrap()
        }

        pub fn grip(mut self, robot: usize, side: Side, object: &str, grip: Grip) -> Facts {
            let object = self.object_mut(object);
            object.hands[robot][side.index()] = grip;
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks;

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
        assert!(
            held.holds(A, Right, "bottle") && held.holds_any(A, "bottle") && !held.hands_off(A, "bottle")
        );
        assert!(
            !held.holds(A, Left, "bottle") && !held.holds(B, Right, "bottle") && held.hands_off(B, "bottle")
        );
        let touched = rest.grip(A, Right, "bottle", Grip::Touching);
        assert!(!touched.holds_any(A, "bottle") && !touched.hands_off(A, "bottle"));
    }

    #[test]
    #[should_panic(expected = "name \"vase\"")]
    fn a_condition_on_something_that_is_not_there_is_a_bug() {
        Facts::at_rest(tasks::find("handover").unwrap()).lift_m("vase");
    }
}
