//! What is under a room whose own floor ends.

use rapier3d::math::{Pose, Vector};

use super::World;
use crate::mechanism::add_collider;
use crate::mjcf::{Geom, Primitive};

/// A plane that leans by less carries what falls on it.
const CARRIES_COSINE: f32 = 0.5;

impl World {
    /// Puts a plane without an end under the lowest shape of the room, unless the room has such a plane itself: exported rooms
    /// have boxes for floors, and what goes over the edge of one would fall for ever. Nobody sees it.
    pub(super) fn lay_ground(&mut self) {
        let carries = |geom: &Geom| {
            let upright = (geom.body_from_geom.rotation * Vector::Z).z;
            matches!(geom.primitive, Primitive::Plane { .. }) && upright > CARRIES_COSINE
        };
        let colliding = || self.fixed.iter().filter(|geom| geom.collides);
        if colliding().any(carries) {
            return;
        }
        let bottom_m = |geom: &Geom| {
            geom.collider().map_or(f32::INFINITY, |(pose, shape)| shape.compute_aabb(&pose).mins.z)
        };
        let lowest = colliding().map(|geom| (bottom_m(geom), geom)).min_by(|a, b| a.0.total_cmp(&b.0));
        let Some((bottom_m, lowest)) = lowest.filter(|(bottom_m, _)| bottom_m.is_finite()) else { return };
        let ground = Geom {
            primitive: Primitive::Plane { half_extents_m: [0.0; 2] },
            body_from_geom: Pose::from_translation(Vector::Z * bottom_m),
            ..lowest.clone()
        };
        add_collider(&mut self.dynamics, &ground, None, None);
    }
}
