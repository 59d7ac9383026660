//! Colliders: convex shapes on links and in the world, and their poses in a step.

use rapier3d::parry::bounding_volume::Aabb;
use rapier3d::parry::shape::TypedShape;
use rapier3d::prelude::SharedShape;
use serde::{Deserialize, Serialize};

use super::friction::Friction;
use crate::dynamics::settings::Settings;
use crate::dynamics::trees::{LinkId, Trees};
use crate::dynamics::{DMat3, DPose3, DVec3};

/// Index of a collider in a world. Colliders are numbered in the order in which they were added.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct ColliderId(pub(in crate::dynamics) u32);

/// Convex shape that touches others.
pub struct Collider {
    pub shape: SharedShape,
    /// The link that carries the collider; `None` for the world.
    pub on: Option<LinkId>,
    /// Pose of the shape in the frame of the link, or in the world frame.
    pub body_from_shape: DPose3,
    pub friction: Friction,
    /// True if the collider is unbounded along its x and y axes. Its shape is then only the part near another
    /// collider.
    pub endless: bool,
    /// Tag by which the owner of the world recognises the collider.
    pub tag: u128,
    pub touches: Mask,
}

/// Collision mask: bits for the kinds of a collider and the kinds that it touches. They are MJCF's `contype`
/// and `conaffinity`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Mask {
    pub kinds: u32,
    pub touched: u32,
}

impl Mask {
    /// Default mask. Colliders with it touch each other.
    pub const ALL: Mask = Mask { kinds: 1, touched: 1 };

    /// Returns true if two colliders with these masks touch. One of them touching a kind of the other is
    /// enough.
    pub fn meets(self, other: Mask) -> bool {
        self.kinds & other.touched != 0 || other.kinds & self.touched != 0
    }
}

/// A collider at its pose in this step.
pub struct Surface {
    pub collider: Collider,
    /// The link that carries the collider; `None` if that link cannot move.
    pub body: Option<LinkId>,
    /// True if the shape rolls on features that Parry treats as edges and corners. Balls are not round
    /// in this sense: Parry finds their point of contact exactly.
    pub is_round: bool,
    /// Centre and half extents of the bounds, in the shape's frame.
    middle_m: DVec3,
    half_m: DVec3,
    half_length_m: f64,
    pub world_from_shape: DPose3,
    /// Distance that the surface may close within the step. Two surfaces can touch if their distance is below
    /// the sum of both reaches.
    pub reach_m: f64,
    /// Bounds in the world frame, grown by `reach_m`.
    pub bounds: Aabb,
    /// True if the surface was placed since its body fell asleep.
    pub sleeps_there: bool,
}

/// Grid spacing of the positions to which the shape of an endless collider is moved. The shape extends more
/// than one spacing beyond what it meets. It stays in place between two moves, so that contact points
/// continue those of the step before.
const TILE_M: f64 = 32.0;
/// Half extent of an endless collider's bounds.
const ENDLESS_M: f64 = 1e6;

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
        let mut half_m = local.half_extents().as_dvec3();
        if collider.endless {
            (half_m.x, half_m.y) = (ENDLESS_M, ENDLESS_M);
        }
        let mut surface = Surface {
            body,
            is_round: is_round(&collider.shape),
            middle_m: local.center().as_dvec3(),
            half_m,
            half_length_m: half_m.length(),
            world_from_shape: DPose3::IDENTITY,
            reach_m: 0.0,
            bounds: local,
            sleeps_there: false,
            collider,
        };
        let spin_rad_s = body.map_or(0.0, |link| trees.spin_rad_s(link));
        surface.place(&world_from_body, spin_rad_s, trees, settings);
        surface
    }

    /// Places the surface by the pose and the spin of its link.
    #[inline(always)]
    pub fn place(&mut self, world_from_body: &DPose3, spin_rad_s: f64, trees: &Trees, settings: &Settings) {
        self.world_from_shape = *world_from_body * self.collider.body_from_shape;
        let middle_m = self.world_from_shape * self.middle_m;
        let fastest_m_s = self.body.map_or(0.0, |id| {
            let tree = &trees.all[id.tree.index()];
            let turning_m_s = spin_rad_s * self.half_length_m;
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

    /// Returns true if the surface cannot move or its body sleeps.
    pub fn is_still(&self, trees: &Trees) -> bool {
        self.body.is_none_or(|link| trees.all[link.tree.index()].is_asleep())
    }

    /// Returns the vector from the centre of this surface to that of the other, in the frame of this surface.
    pub fn towards(&self, other: &Surface) -> DVec3 {
        let middle_m = other.world_from_shape * other.middle_m;
        self.world_from_shape.inverse() * middle_m - self.middle_m
    }

    /// Returns the pose of the shape for contacts with another surface. The shape of an endless collider is
    /// moved next to that surface.
    pub fn beside(&self, other: &Surface) -> DPose3 {
        let other_m = other.world_from_shape * other.middle_m;
        let near = other_m.distance_squared(self.world_from_shape.translation) < (0.5 * TILE_M).powi(2);
        if near || !self.collider.endless {
            return self.world_from_shape;
        }
        let away_m = self.world_from_shape.inverse() * other_m;
        let tile_m = |away_m: f64| (away_m / TILE_M).round() * TILE_M;
        let moved_m = DVec3::new(tile_m(away_m.x), tile_m(away_m.y), 0.0);
        self.world_from_shape * DPose3::from_translation(moved_m)
    }
}

fn is_round(shape: &SharedShape) -> bool {
    matches!(
        shape.as_typed_shape(),
        TypedShape::Cylinder(_)
            | TypedShape::Cone(_)
            | TypedShape::RoundCylinder(_)
            | TypedShape::RoundCone(_)
    )
}
