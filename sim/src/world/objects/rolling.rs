//! Rolling resistance, which Rapier does not have and without which a ball on a flat base never comes to rest.

use rapier3d::prelude::PhysicsWorld;

use super::{Object, ObjectModel};
use crate::GRAVITY_M_S2;

/// Slower than this, rolling resistance acts as a damper: a fixed torque would turn the ball back.
const SLOWEST_ROLLING_RAD_S: f32 = 0.5;

impl Object {
    /// The damping of one physics step takes from the measured rate what MuJoCo's rolling friction r (m) would:
    ///   I w' = -r m g
    pub(in crate::world) fn resist_rolling(&self, physics: &mut PhysicsWorld) {
        let Some(handle) = self.body.filter(|_| self.rolling_rad_s2 > 0.0) else { return };
        let body = &mut physics.bodies[handle];
        body.set_angular_damping(self.rolling_rad_s2 / body.angvel().length().max(SLOWEST_ROLLING_RAD_S));
    }
}

/// r m g / I of the geom with the largest rolling friction r.
pub(super) fn rolling_rad_s2(model: &ObjectModel) -> f32 {
    let rolling_m =
        model.geoms.iter().map(|geom| geom.surface.against(&geom.surface).roll_m).fold(0.0, f32::max);
    let inertia_kg_m2 = model.mass.principal_inertia().max_element();
    if inertia_kg_m2 == 0.0 { 0.0 } else { rolling_m * model.mass.mass() * GRAVITY_M_S2 / inertia_kg_m2 }
}
