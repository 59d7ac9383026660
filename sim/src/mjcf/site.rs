//! Sites: points and regions that a file gives a name to, so that nobody else has to know where they are.

use rapier3d::math::{Pose, Vector};

use super::{pose, vector};

/// A named point of a body, or a region around it.
#[derive(Clone, Debug, PartialEq)]
pub struct Site {
    pub name: String,
    pub body_from_site: Pose,
    /// MJCF's `size`: of a sphere the radius; of a cylinder (along z) the radius and half the length; of a box half the
    /// extents.
    pub size_m: Vector,
}

impl Site {
    pub(crate) fn read(site: &mjcf_rs::body::Site) -> Site {
        Site {
            name: site.name.clone().unwrap_or_default(),
            body_from_site: pose(&site.pose),
            size_m: vector(site.size),
        }
    }

    /// In the body's frame.
    pub fn position_m(&self) -> Vector {
        self.body_from_site.translation
    }

    /// Of a sphere or a cylinder.
    pub fn radius_m(&self) -> f32 {
        self.size_m.x
    }

    /// Smallest and largest corner, in the body's frame, of a box that lies along its axes.
    pub fn corners_m(&self) -> [Vector; 2] {
        [self.position_m() - self.size_m, self.position_m() + self.size_m]
    }
}
