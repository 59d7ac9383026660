//! Worlds for tests, put together by hand.

use tandem_sim::{ObjectModel, ObjectPart};

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

    /// As [`Facts::grip`], of robots that each hold `object` with both hands.
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
