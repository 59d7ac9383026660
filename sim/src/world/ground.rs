//! The ground under a room whose own floor is bounded.

use rapier3d::math::{Pose, Vector};

use super::World;
use crate::dynamics::{Collider, DPose3, DVec3, Directions, Friction, Mask};
use crate::mechanism::{add_collider, rounded};
use crate::mjcf::{Geom, Gloss, Primitive};

/// Cosine of the maximum tilt of a plane that carries fallen objects.
const CARRIES_COSINE: f64 = 0.5;
/// Default friction of MJCF.
const PLAIN: Friction = Friction {
    directions: Directions::Slide,
    slide: 1.0,
    spin_m: 0.005,
    roll_m: 0.0001,
    priority: 0,
    left: 1.0,
};

impl World {
    /// Puts an endless plane under the lowest shape of the scene, unless the scene already has an endless
    /// floor. Exported rooms have boxes for floors, and an object that slides over the edge would fall
    /// forever. In a scene without colliders the plane is at z = 0, where robots are put. The plane is not
    /// drawn.
    pub(super) fn lay_ground(&mut self) {
        // No joint moves a plane.
        let carries = |(collider, at): (&Collider, DPose3)| {
            collider.endless && (at.rotation * DVec3::Z).z > CARRIES_COSINE
        };
        if self.dynamics.colliders().any(carries) {
            return;
        }
        // Moving bodies count, too: none may start within the ground. Walls that are planes have no lowest
        // point.
        let shapes = self.dynamics.colliders().filter(|(collider, _)| !collider.endless);
        let bottom_m = |(collider, at): (&Collider, DPose3)| {
            (collider.shape.compute_aabb(&rounded(&at)).mins.z, collider.friction)
        };
        let lowest = shapes.map(bottom_m).min_by(|a, b| a.0.total_cmp(&b.0));
        let (bottom_m, friction) = lowest.unwrap_or((0.0, PLAIN));
        let ground = Geom {
            name: None,
            primitive: Primitive::Plane { half_extents_m: [0.0; 2] },
            body_from_geom: Pose::from_translation(Vector::Z * bottom_m),
            rgba: [0.0; 4],
            gloss: Gloss::default(),
            material: None,
            image: None,
            checker_rgb: None,
            friction,
            density_kg_m3: 0.0,
            mass_kg: None,
            collides: true,
            touches: Mask::ALL,
            drawn: false,
            pattern: None,
        };
        add_collider(&mut self.dynamics, &ground, None, None);
    }
}
