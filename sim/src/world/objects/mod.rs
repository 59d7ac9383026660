//! Objects: everything named in a world that is not a robot, free or fixed.

mod insert;
mod model;
mod rolling;
#[cfg(test)]
mod site_tests;

use rapier3d::math::{Pose, Vector};
use rapier3d::prelude::*;
use serde::{Deserialize, Serialize};

pub use model::ObjectModel;

pub(super) use insert::{insert_object, insert_scene};

/// An object file put into the world.
#[derive(Clone, Debug)]
pub struct ObjectPlacement {
    /// What tasks call it.
    pub name: String,
    /// Name of the file in `assets/objects`; several objects may share one.
    pub file: String,
    pub world_from_object: Pose,
}

/// Pose and velocity of an object's frame, world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    pub world_from_object: Pose,
    pub velocity_m_s: Vector,
    pub angular_velocity_rad_s: Vector,
}

/// Something named that is not a robot: a free body, or a mark that only is looked at.
pub(super) struct Object {
    /// What tasks call it.
    pub name: String,
    pub model: ObjectModel,
    pub body: Option<RigidBodyHandle>,
    /// Where a mark lies; a body's pose is Rapier's.
    pub world_from_mark: Pose,
    pub colliders: Vec<ColliderHandle>,
    /// Deceleration by rolling resistance, rad/s^2; 0 for what does not roll.
    rolling_rad_s2: f32,
}

impl Object {
    pub(super) fn state(&self, physics: &PhysicsWorld) -> ObjectState {
        match self.body.map(|handle| &physics.bodies[handle]) {
            Some(body) => ObjectState {
                world_from_object: *body.position(),
                velocity_m_s: body.velocity_at_point(body.position().translation),
                angular_velocity_rad_s: body.angvel(),
            },
            None => ObjectState {
                world_from_object: self.world_from_mark,
                velocity_m_s: Vector::ZERO,
                angular_velocity_rad_s: Vector::ZERO,
            },
        }
    }
}
