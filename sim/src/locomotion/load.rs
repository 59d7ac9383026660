//! What pulls and pushes, as seen by the balance: a wrench about the centre of mass and the point it has to stand over.

use rapier3d::math::Vector;

use crate::GRAVITY_M_S2;
use crate::robot::WholeBody;

/// External wrench, world frame, and its effect on balance: weights in the hands and an observed push.
pub(super) struct Load {
    pub force_n: Vector,
    /// About the centre of mass.
    pub moment_n_m: Vector,
    /// Where the centre of pressure of a robot at rest lies: the centre of mass, moved by the wrench and the push.
    pub balance_point_m: Vector,
}

/// Pushes and pulls are taken to act this high over the centre of mass: at the chest and the hands.
const PUSH_LEVER_M: f32 = 0.19;
/// A lighter weight is arm motion and friction, not a load.
const DEAD_ZONE_N: f32 = 6.0;

impl Load {
    /// With height h of the centre of mass c over the ground and vertical load N = m g - f_z:
    ///   p = c + ( m_y + h f_x, -m_x + h f_y ) / N.
    pub(super) fn of(body: &WholeBody, ground_m: f32, push_m_s2: Vector) -> Load {
        let (mut force_n, mut moment_n_m) = (Vector::ZERO, Vector::ZERO);
        for (hand_n, palm_m) in body.hand_force_n.into_iter().zip(body.palms_m()) {
            // What pulls sideways is part of the push.
            let felt_n = Vector::new(0.0, 0.0, (hand_n.z + DEAD_ZONE_N).min(0.0));
            force_n += felt_n;
            moment_n_m += (palm_m - body.com_m).cross(felt_n);
        }
        let pushing_n = push_m_s2 * body.model.mass_kg;
        force_n += pushing_n;
        moment_n_m += Vector::new(0.0, 0.0, PUSH_LEVER_M).cross(pushing_n);
        let height_m = body.com_m.z - ground_m;
        let vertical_n = body.model.mass_kg * GRAVITY_M_S2 - force_n.z;
        let away_m =
            Vector::new(moment_n_m.y + height_m * force_n.x, height_m * force_n.y - moment_n_m.x, 0.0);
        Load { force_n, moment_n_m, balance_point_m: body.com_m + away_m / vertical_n }
    }
}
