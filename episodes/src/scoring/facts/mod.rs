//! Facts about the world for scoring and experts. No policy receives them.

use std::sync::Arc;

use tandem_sim::{ObjectModel, Pose, RobotModel, Side, Sides, Vector, mjcf::Site};

/// Index of robot A in [`Facts::robots`].
pub const A: usize = 0;
/// Index of robot B.
pub const B: usize = 1;
/// Index of robot C.
pub const C: usize = 2;
/// Names of robots, by index.
pub const ROBOT_NAMES: [&str; 3] = ["A", "B", "C"];

/// The world at one control step.
#[derive(Clone, Debug)]
pub struct Facts {
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// Facts about each robot, A first.
    pub robots: Vec<RobotFacts>,
    pub objects: Vec<ObjectFacts>,
}

/// One robot.
#[derive(Clone, Debug)]
pub struct RobotFacts {
    /// Its shapes.
    pub model: Arc<RobotModel>,
    /// Pose of every link, in the order of [`RobotModel::links`].
    pub world_from_link: Vec<Pose>,
    pub pelvis_in_world: Pose,
    pub wrist_in_pelvis: Sides<Pose>,
    /// Force of the world on each palm, in the world's frame, estimated from the arm's own torques. A hand
    /// that holds 0.5 kg reads -4.9 N along z. A hand in fast motion also reads its own inertia.
    pub hand_force_n: Sides<Vector>,
    pub fallen: bool,
}

/// One object and the hands on it.
#[derive(Clone, Debug)]
pub struct ObjectFacts {
    pub name: String,
    /// Its shapes, and the points and regions that its file names.
    pub model: Arc<ObjectModel>,
    pub pose_in_world: Pose,
    pub velocity_m_s: Vector,
    pub angular_velocity_rad_s: Vector,
    /// Height of the object's origin above the floor when the episode began.
    pub rest_height_m: f32,
    /// Grip of each robot's hands on it.
    pub hands: Vec<Sides<Grip>>,
    /// Time for which no part of any robot has touched it.
    pub untouched_s: f64,
    /// Motion of its hinge (rad) or slide (m) from the pose in the file, positive towards the farther end of
    /// the range; `None` if it has neither.
    pub opened_value: Option<f32>,
}

/// Contact of a hand with an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Grip {
    /// No contact at all.
    Off,
    /// Contact, but not from two sides.
    Touching,
    /// A hold according to the grasp detector.
    Holding,
}

impl Facts {
    /// Returns `true` if this hand of this robot holds `object`.
    pub fn holds(&self, robot: usize, side: Side, object: &str) -> bool {
        self.object(object).hands[robot][side] == Grip::Holding
    }

    /// Returns `true` if any hand of this robot holds `object`.
    pub fn holds_any(&self, robot: usize, object: &str) -> bool {
        self.object(object).hands[robot].iter().any(|grip| *grip == Grip::Holding)
    }

    /// Returns `true` if neither hand of this robot touches `object`.
    pub fn hands_off(&self, robot: usize, object: &str) -> bool {
        self.object(object).hands[robot] == Sides::both(Grip::Off)
    }

    /// Returns the time for which no part of any robot has touched `object`.
    pub fn untouched_s(&self, object: &str) -> f64 {
        self.object(object).untouched_s
    }

    /// Returns the height of the origin of `object` above its rest height at the start of the episode.
    pub fn lift_m(&self, object: &str) -> f32 {
        let object = self.object(object);
        object.pose_in_world.translation.z - object.rest_height_m
    }

    /// Returns the height of the lowest point of `object` above the rest height of its origin at the start of
    /// the episode. For an object that stood upright, this is the clearance of the whole object above its
    /// support.
    pub fn clearance_m(&self, object: &str) -> f32 {
        self.lowest_m(object) - self.object(object).rest_height_m
    }

    /// Returns the height above the floor of the lowest point of `object`.
    pub fn lowest_m(&self, object: &str) -> f32 {
        -self.reach_m(object, Vector::NEG_Z)
    }

    /// Returns the height above the floor of the highest point of `object`.
    pub fn highest_m(&self, object: &str) -> f32 {
        self.reach_m(object, Vector::Z)
    }

    /// Returns the extent of `object` along a direction of the world, a unit vector, from the world's
    /// origin.
    pub fn reach_m(&self, object: &str, direction: Vector) -> f32 {
        let object = self.object(object);
        object.model.reach_m(&object.pose_in_world, direction)
    }

    /// Returns the extent of a robot along a direction of the world, a unit vector, from the world's
    /// origin.
    pub fn robot_reach_m(&self, robot: usize, direction: Vector) -> f32 {
        let robot = &self.robots[robot];
        robot.model.reach_m(&robot.world_from_link, direction)
    }

    /// Returns the angle between the z axis of `object` and the world's.
    pub fn tilt_rad(&self, object: &str) -> f32 {
        let up_in_world = self.object(object).pose_in_world.rotation * Vector::Z;
        up_in_world.angle_between(Vector::Z)
    }

    /// Returns the displacement of the hinge (rad) or slide (m) of `object` from its pose in the file.
    pub fn opened(&self, object: &str) -> f32 {
        self.object(object).opened_value.unwrap_or_default()
    }

    pub fn speed_m_s(&self, object: &str) -> f32 {
        self.object(object).velocity_m_s.length()
    }

    pub fn turn_rate_rad_s(&self, object: &str) -> f32 {
        self.object(object).angular_velocity_rad_s.length()
    }

    /// Returns `true` if each of these robots holds `object` with a hand.
    pub fn held_by_all(&self, robots: &[usize], object: &str) -> bool {
        robots.iter().all(|robot| self.holds_any(*robot, object))
    }

    /// Returns the horizontal distance between the origins of two objects.
    pub fn apart_m(&self, object: &str, other: &str) -> f32 {
        (self.position_m(object) - self.position_m(other)).truncate().length()
    }

    /// Returns the position of the origin of `object` in the frame of another object.
    pub fn seen_from_m(&self, frame: &str, object: &str) -> Vector {
        self.object(frame).pose_in_world.inverse() * self.position_m(object)
    }

    /// Returns the rotation of `object` about the vertical relative to another object, from -pi to pi.
    pub fn turned_rad(&self, frame: &str, object: &str) -> f32 {
        let [frame, object] = [frame, object].map(|name| self.object(name).pose_in_world.rotation);
        let x = frame.inverse() * (object * Vector::X);
        x.y.atan2(x.x)
    }

    /// Returns the world position of the origin of `object`.
    pub fn position_m(&self, object: &str) -> Vector {
        self.object(object).pose_in_world.translation
    }

    /// Returns the world position of a point fixed to `object`, given in its frame.
    pub fn point_m(&self, object: &str, point_in_object_m: Vector) -> Vector {
        self.object(object).pose_in_world * point_in_object_m
    }

    /// Returns the world position of a site of `object`.
    pub fn site_m(&self, object: &str, site: &str) -> Vector {
        self.point_m(object, self.site(object, site).position_m())
    }

    /// Returns `true` if the origin of `object` is between the walls of `vessel` and over its floor,
    /// according to its shapes.
    pub fn inside_vessel(&self, object: &str, vessel: &str) -> bool {
        let vessel = self.object(vessel);
        vessel.model.encloses(vessel.pose_in_world.inverse() * self.position_m(object))
    }

    /// Returns `true` if the origin of `object` is inside a box site of `container`.
    pub fn inside_box(&self, object: &str, container: &str, site: &str) -> bool {
        let [low_m, high_m] = self.site(container, site).corners_m();
        let local = self.object(container).pose_in_world.inverse() * self.position_m(object);
        local.cmpge(low_m).all() && local.cmple(high_m).all()
    }

    /// Returns `true` if a box site of `object` is, seen along z of `target`, wholly within a box site of
    /// `target`.
    pub fn within_mark(&self, object: &str, site: &str, target: &str, mark: &str) -> bool {
        let (site, mark) = (self.site(object, site), self.site(target, mark));
        let target_from_object =
            self.object(target).pose_in_world.inverse() * self.object(object).pose_in_world;
        let beside_m = target_from_object * site.position_m() - mark.position_m();
        let turn = target_from_object.rotation;
        let half_m = (turn * Vector::X).abs() * site.size_m.x
            + (turn * Vector::Y).abs() * site.size_m.y
            + (turn * Vector::Z).abs() * site.size_m.z;
        (beside_m.abs() + half_m).truncate().cmple(mark.size_m.truncate()).all()
    }

    /// Returns `true` if a rod of `object`, from one site to another, passes through a ring of `carrier`, a
    /// site with its axis along y.
    pub fn threads(&self, object: &str, ends: [&str; 2], carrier: &str, ring: &str) -> bool {
        let ring = self.site(carrier, ring);
        let carrier_from_object =
            self.object(carrier).pose_in_world.inverse() * self.object(object).pose_in_world;
        let end_m = |end: &str| carrier_from_object * self.site(object, end).position_m() - ring.position_m();
        let [a, b] = ends.map(end_m);
        if a.y * b.y > 0.0 {
            return false;
        }
        let crossing = a + (b - a) * (a.y / (a.y - b.y));
        crossing.x.hypot(crossing.z) <= ring.radius_m()
    }

    /// Returns a site of `object`.
    ///
    /// # Panics
    ///
    /// If the object's file has no such site, which is a mistake in the task or the file.
    pub fn site(&self, object: &str, name: &str) -> &Site {
        match self.object(object).model.site(name) {
            Some(site) => site,
            None => {
                panic!("the file of {object:?} has no site {name:?}, which a task or its expert asks for")
            }
        }
    }

    /// Returns the facts of an object.
    ///
    /// # Panics
    ///
    /// If the task has no such object, which is a mistake in the task's file.
    pub fn object(&self, name: &str) -> &ObjectFacts {
        match self.objects.iter().find(|object| object.name == name) {
            Some(object) => object,
            None => panic!("the task's conditions name {name:?}, which its table of objects does not"),
        }
    }
}

#[cfg(test)]
mod constructed;
