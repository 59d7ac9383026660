//! Contacts between colliders, and the constraints that they put on velocities.

pub mod collider;
pub mod collision;
pub mod friction;
mod near;
pub mod overlap;

use rapier3d::glamx::DVec3;
use serde::{Deserialize, Serialize};

use crate::dynamics::trees::LinkId;
use collider::ColliderId;
use friction::Friction;

/// A point at which two colliders touched in the last step.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct ContactPoint {
    /// The two colliders, the one added earlier first.
    pub colliders: [ColliderId; 2],
    /// Position in the world frame, midway between the surfaces.
    pub point_m: DVec3,
    /// Unit normal, from the first collider to the second.
    pub normal: DVec3,
    /// Distance between the surfaces; negative if they overlap.
    pub gap_m: f64,
    /// Impulse on the second collider in the last step, friction included, N s.
    pub impulse_n_s: DVec3,
    /// Part of the impulse along the normal.
    pub normal_impulse_n_s: f64,
    /// Index of the point among those of the same pair.
    pub(in crate::dynamics) number: u32,
    /// The point on each collider, in that collider's frame.
    pub(in crate::dynamics) local_m: [DVec3; 2],
    /// Impulses with which the next step begins.
    pub(in crate::dynamics) memory: Impulses,
}

/// Impulses of the correcting pass: normal, tangent (world axes), spin about the normal, roll (world axes).
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub struct Impulses {
    pub normal: f64,
    pub tangent: DVec3,
    pub spin: f64,
    pub roll: DVec3,
}

/// Returns the two colliders of a point, by which points are sorted.
pub fn colliders_of(touch: &ContactPoint) -> [ColliderId; 2] {
    touch.colliders
}

impl Impulses {
    /// Returns the impulses as lanes of a contact with these directions: normal and two tangents.
    pub fn lanes(&self, [_, t1, t2]: [DVec3; 3]) -> [f64; 6] {
        let (tangent, roll) = (self.tangent, self.roll);
        [self.normal, tangent.dot(t1), tangent.dot(t2), self.spin, roll.dot(t1), roll.dot(t2)]
    }

    pub fn of_lanes(lanes: [f64; 6], [_, t1, t2]: [DVec3; 3]) -> Impulses {
        let [normal, a, b, spin, c, d] = lanes;
        Impulses { normal, tangent: t1 * a + t2 * b, spin, roll: t1 * c + t2 * d }
    }
}

/// Contact point during a step.
#[derive(Clone, Copy)]
pub struct Candidate {
    pub touch: ContactPoint,
    pub bodies: [Option<LinkId>; 2],
    pub friction: Friction,
    /// Normal and two tangents, world frame.
    pub directions: [DVec3; 3],
}

/// Returns the impulses of the point of the last step that this one continues: the nearest point of the same
/// pair, on either surface. Returns `None` if no point is within `match_m`.
pub fn continued(touch: &ContactPoint, before: &[ContactPoint], match_m: f64) -> Option<Impulses> {
    let away = |old: &ContactPoint| {
        let on = |side: usize| old.local_m[side].distance_squared(touch.local_m[side]);
        on(0).min(on(1))
    };
    let mut nearest = match_m * match_m;
    let mut found = None;
    for old in before {
        let distance = away(old);
        if distance < nearest {
            (nearest, found) = (distance, Some(old.memory));
        }
    }
    found
}
