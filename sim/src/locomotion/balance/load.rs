//! What pulls and pushes, as seen by the balance: a wrench about the centre of mass and the point it has to stand over.

use rapier3d::math::Vector;

use crate::GRAVITY_M_S2;
use crate::body::WholeBody;
use crate::locomotion::plane::flat;

/// External wrench, world frame, and its effect on balance: weights in the hands and an observed push.
pub(super) struct Load {
    pub force_n: Vector,
    /// About the centre of mass.
    pub moment_n_m: Vector,
    /// Where the centre of pressure of a robot at rest lies: the centre of mass, moved by the wrench and the push.
    pub balance_point_m: Vector,
    /// Moment about the vertical of what pulls both hands alike. What one hand feels more than the other may be the other's doing:
    /// robots that held against that would wring what they have in both hands.
    pub pulled_n_m: f32,
}

/// Pushes and pulls are taken to act this high over the centre of mass: at the chest and the hands.
const PUSH_LEVER_M: f32 = 0.19;
/// A lighter weight is arm motion and friction, not a load.
const DEAD_ZONE_N: f32 = 6.0;
/// More about the vertical than a foot can hold is not fed forward.
const LARGEST_TURN_N_M: f32 = 20.0;
/// An arm does not feel along itself: a pull turns the robot more than its hands feel by about this factor.
const TURN_PER_FELT: f32 = 1.3;

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
            // What turns the robot, the hands alone tell: the push acts over the centre of mass.
            moment_n_m.z += (palm_m - body.com_m).cross(flat(hand_n)).z;
        }
        moment_n_m.z = moment_n_m.z.clamp(-LARGEST_TURN_N_M, LARGEST_TURN_N_M);
        let palms_m: Vector = body.palms_m().into_iter().sum();
        let pull_n = flat(body.hand_force_n.left + body.hand_force_n.right);
        let pulled_n_m = (palms_m * 0.5 - body.com_m).cross(pull_n).z * TURN_PER_FELT;
        let pulled_n_m = pulled_n_m.clamp(-LARGEST_TURN_N_M, LARGEST_TURN_N_M);
        let pushing_n = push_m_s2 * body.model.mass_kg;
        force_n += pushing_n;
        moment_n_m += Vector::new(0.0, 0.0, PUSH_LEVER_M).cross(pushing_n);
        let height_m = body.com_m.z - ground_m;
        let vertical_n = body.model.mass_kg * GRAVITY_M_S2 - force_n.z;
        let away_m =
            Vector::new(moment_n_m.y + height_m * force_n.x, height_m * force_n.y - moment_n_m.x, 0.0);
        Load { force_n, moment_n_m, balance_point_m: body.com_m + away_m / vertical_n, pulled_n_m }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Sides;
    use crate::body::posed::Posed;

    #[test]
    fn a_robot_stands_under_what_it_carries() {
        let mut body = Posed::standing().body();
        let free = Load::of(&body, 0.0, Vector::ZERO);
        assert_eq!(
            (free.force_n, free.moment_n_m, free.balance_point_m),
            (Vector::ZERO, Vector::ZERO, body.com_m)
        );

        // Equal weights in both hands act as one in the middle: the common centre of mass.
        let weight_n = 20.0;
        body.hand_force_n = Sides::both(Vector::new(0.0, 0.0, -weight_n - DEAD_ZONE_N));
        let loaded = Load::of(&body, 0.0, Vector::ZERO);
        let palms_m: Vector = body.palms_m().into_iter().sum();
        let robot_n = body.model.mass_kg * GRAVITY_M_S2;
        let common_m = (body.com_m * robot_n + palms_m * weight_n) / (robot_n + 2.0 * weight_n);
        let away_m = loaded.balance_point_m - common_m;
        assert!(away_m.x.abs() < 1e-5 && away_m.y.abs() < 1e-5, "{away_m}");

        // What lifts, and what is lighter than the dead zone, is no load.
        body.hand_force_n = Sides { left: Vector::Z * 30.0, right: Vector::Z * -0.9 * DEAD_ZONE_N };
        assert_eq!(Load::of(&body, 0.0, Vector::ZERO).force_n, Vector::ZERO);
    }

    /// Against a steady push a robot leans: moments about the pressure point cancel.
    #[test]
    fn a_push_is_leant_against() {
        let body = Posed::standing().body();
        let push_m_s2 = Vector::new(0.5, 0.0, 0.0);
        let load = Load::of(&body, 0.0, push_m_s2);
        let lean_m = body.com_m.x - load.balance_point_m.x;
        let expected_m = -push_m_s2.x * (body.com_m.z + PUSH_LEVER_M) / GRAVITY_M_S2;
        assert!((lean_m - expected_m).abs() < 1e-5, "{lean_m} {expected_m}");
    }
}
