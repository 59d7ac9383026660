//! Colliders: convex shapes on links and in the world, and where they are in a step.

use rapier3d::math::Pose;
use rapier3d::parry::bounding_volume::Aabb;
use rapier3d::prelude::SharedShape;
use serde::{Deserialize, Serialize};

use super::friction::Friction;
use crate::dynamics::settings::Settings;
use crate::dynamics::trees::spatial::rounded;
use crate::dynamics::trees::{LinkId, Trees};
use crate::dynamics::{DMat3, DPose3, DVec3};

/// A collider of a world; they count in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ColliderId(pub(in crate::dynamics) u32);

/// A convex shape that touches others.
pub struct Collider {
    pub shape: SharedShape,
    /// The link that carries it, or the world.
    pub on: Option<LinkId>,
    /// Pose of the shape in the link's frame, or in the world's.
    pub body_from_shape: DPose3,
    pub friction: Friction,
    /// Tells whoever owns the world whose collider it is.
    pub tag: u128,
}

/// A collider where it is in this step.
pub struct Surface {
    pub collider: Collider,
    /// The link that carries it, if something moves that.
    pub body: Option<LinkId>,
    /// Middle and half extents of its bounds, in its own frame.
    middle_m: DVec3,
    half_m: DVec3,
    pub world_from_shape: DPose3,
    /// How near another surface may be that it could touch within the step; each side of a pair has a part in it.
    pub reach_m: f64,
    /// World frame, with its reach.
    pub bounds: Aabb,
}

impl ColliderId {
    #[inline]
    pub(in crate::dynamics) fn index(self) -> usize {
        self.0 as usize
    }
}

impl Surface {
    pub fn new(collider: Collider, trees: &Trees, settings: &Settings) -> Surface {
        let local = collider.shape.compute_local_aabb();
        let body = collider.on.filter(|link| trees.moves(*link));
        let world_from_body = collider.on.map_or(DPose3::IDENTITY, |link| trees.world_from(link));
        let mut surface = Surface {
            body,
            middle_m: local.center().as_dvec3(),
            half_m: local.half_extents().as_dvec3(),
            world_from_shape: DPose3::IDENTITY,
            reach_m: 0.0,
            bounds: local,
            collider,
        };
        surface.place(&world_from_body, trees, settings);
        surface
    }

    /// Puts it where its link is now.
    pub fn place(&mut self, world_from_body: &DPose3, trees: &Trees, settings: &Settings) {
        self.world_from_shape = *world_from_body * self.collider.body_from_shape;
        let middle_m = self.world_from_shape * self.middle_m;
        let fastest_m_s = self.body.map_or(0.0, |id| {
            let tree = &trees.all[id.tree.index()];
            let turning_m_s = tree.velocity[id.link].angular.length() * self.half_m.length();
            tree.point_velocity_m_s(id.link, middle_m).length() + turning_m_s
        });
        self.reach_m = (fastest_m_s + 0.5 * settings.margin_m_s) * settings.dt_s;
        let turn = DMat3::from_quat(self.world_from_shape.rotation);
        let half_m = turn.x_axis.abs() * self.half_m.x
            + turn.y_axis.abs() * self.half_m.y
            + turn.z_axis.abs() * self.half_m.z
            + DVec3::splat(self.reach_m);
        self.bounds = Aabb::new((middle_m - half_m).as_vec3(), (middle_m + half_m).as_vec3());
    }

    /// The vector from the middle of this surface to that of another, in the frame of this one.
    pub fn towards(&self, other: &Surface) -> DVec3 {
        let middle_m = other.world_from_shape * other.middle_m;
        self.world_from_shape.inverse() * middle_m - self.middle_m
    }

    /// Pose of another surface in the frame of this one.
    pub fn pose_of(&self, other: &Surface) -> Pose {
        rounded(&(self.world_from_shape.inverse() * other.world_from_shape))
    }
}
