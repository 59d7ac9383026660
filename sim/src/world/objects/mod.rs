//! Objects: all named bodies and marks in a world except robots. A file with inner joints gives one object
//! per link.

mod insert;
#[cfg(test)]
mod joined_tests;
mod model;
mod opening;
#[cfg(test)]
mod site_tests;

use rapier3d::math::{Pose, Vector};
use serde::{Deserialize, Serialize};

pub use model::{ObjectFile, ObjectModel, ObjectPart};
pub use opening::{Opening, OpeningKind};

use crate::dynamics::{Dynamics, LinkId};
use crate::mechanism::rounded;

pub(super) use insert::{Furniture, insert_object, insert_scene};

/// Placement of an object file in the world, or of a free body of the scene.
#[derive(Clone, Debug)]
pub struct ObjectPlacement {
    /// Name of the object in tasks.
    pub name: String,
    /// The object's file; several objects may share one.
    pub file: ObjectFile,
    pub world_from_object: Pose,
}

/// Pose and velocity of an object's frame, world frame.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ObjectState {
    pub world_from_object: Pose,
    pub velocity_m_s: Vector,
    pub angular_velocity_rad_s: Vector,
}

/// A named object that is not a robot: a moving link, or a mark, which only denotes a place.
pub(super) struct Object {
    /// Name of the object in tasks.
    pub name: String,
    pub model: ObjectModel,
    pub link: Option<LinkId>,
    /// Name of a link's joint in its file.
    pub joint: Option<String>,
    /// Pose of a mark; a link's pose is that of dynamics.
    pub world_from_mark: Pose,
}

impl Object {
    pub(super) fn state(&self, dynamics: &Dynamics) -> ObjectState {
        match self.link.map(|id| (dynamics.tree(id.tree), id.link)) {
            Some((tree, link)) => ObjectState {
                world_from_object: rounded(&tree.world_from_link(link)),
                velocity_m_s: tree.link_velocity_m_s(link).as_vec3(),
                angular_velocity_rad_s: tree.link_spin_rad_s(link).as_vec3(),
            },
            None => ObjectState {
                world_from_object: self.world_from_mark,
                velocity_m_s: Vector::ZERO,
                angular_velocity_rad_s: Vector::ZERO,
            },
        }
    }
}
