//! Loads for the balance: a wrench about the centre of mass, and the point to balance over.

use rapier3d::math::Vector;

use super::observer::SplitPush;
use crate::body::BodyEstimate;
use crate::plane::flat;
use crate::{GRAVITY_M_S2, Sides};

/// A robot and its loads as one body. Each load is a mass in the palm; its swing does not push the robot.
pub(super) struct LadenRobot {
    carried_kg: Sides<f32>,
    pub mass_kg: f32,
    pub velocity_m_s: Vector,
}

impl LadenRobot {
    pub(super) fn of(body: &BodyEstimate) -> LadenRobot {
        let dead_zone_n = body.model.scale.force_n(DEAD_ZONE_N);
        let carried_kg =
            body.hand_reaction_n.map(|force_n| (-force_n.z - dead_zone_n).max(0.0) / GRAVITY_M_S2);
        let mut mass_kg = body.model.mass_kg;
        let mut momentum_kg_m_s = body.com_velocity_m_s * mass_kg;
        for (carried_kg, palm_m_s) in carried_kg.into_iter().zip(body.palm_velocity_m_s) {
            mass_kg += carried_kg;
            momentum_kg_m_s += palm_m_s * carried_kg;
        }
        LadenRobot { carried_kg, mass_kg, velocity_m_s: momentum_kg_m_s / mass_kg }
    }
}

/// External wrench, world frame, and its effect on balance: weights in the hands and an observed push.
pub(super) struct Load {
    pub force_n: Vector,
    /// Moment about the centre of mass.
    pub moment_n_m: Vector,
    /// Centre of pressure of a robot at rest: the centre of mass, moved by the wrench and the push.
    pub balance_point_m: Vector,
    /// Centre of pressure without the push: the common centre of mass of the robot and its loads.
    pub weights_point_m: Vector,
    /// Velocity of the balance point due to changes of the push.
    pub balance_point_m_s: Vector,
    /// Velocity of the robot and its loads, as one body.
    pub velocity_m_s: Vector,
    /// Degree to which the robot leans ahead of pulls, 0 to 1: see [`super::stand::Ahead`].
    pub ahead: f32,
    /// Degree to which the robot yields to pulls on its hands, 0 to 1: see [`super::stand::Partner`].
    pub yield_share: f32,
}

/// Assumed height of pushes and pulls over the centre of mass: at the chest and the hands.
const PUSH_LEVER_M: f32 = 0.19;
/// Weight below which a load counts as arm motion and friction.
const DEAD_ZONE_N: f32 = 6.0;
/// Maximum moment about the vertical that is fed forward, which is a foot's limit.
const LARGEST_TURN_N_M: f32 = 20.0;
/// Reduction of that maximum if the feet hold the moment by pushing in opposite directions.
const TURN_LEFT_OUT_N_M: f32 = 10.0;

impl Load {
    /// Computes the load. With height h of the centre of mass c over the ground and vertical load N = m
    /// g - f_z:
    ///   p = c + ( m_y + h f_x, -m_x + h f_y ) / N.
    pub(super) fn of(
        body: &BodyEstimate,
        laden: &LadenRobot,
        ground_m: f32,
        push: impl Into<SplitPush>,
        ahead: f32,
    ) -> Load {
        let SplitPush { rest: push, hands_m_s2, hands_lever_m, yield_share } = push.into();
        let scale = &body.model.scale;
        let push_lever_m = scale.length_m(PUSH_LEVER_M);
        let height_m = body.com_m.z - ground_m;
        let balanced_m = |force_n: Vector, moment_n_m: Vector| {
            let away_m =
                Vector::new(moment_n_m.y + height_m * force_n.x, height_m * force_n.y - moment_n_m.x, 0.0);
            body.com_m + away_m / (body.model.mass_kg * GRAVITY_M_S2 - force_n.z)
        };
        let (mut force_n, mut moment_n_m) = (Vector::ZERO, Vector::ZERO);
        let palms_m = body.palms_m();
        for (carried_kg, palm_m) in laden.carried_kg.into_iter().zip(palms_m) {
            let weight_n = Vector::new(0.0, 0.0, -carried_kg * GRAVITY_M_S2);
            force_n += weight_n;
            moment_n_m += (palm_m - body.com_m).cross(weight_n);
        }
        let weights_point_m = balanced_m(force_n, moment_n_m);
        for (hand_n, palm_m) in body.hand_reaction_n.into_iter().zip(palms_m) {
            // A sideways pull is part of the push. A moment about the vertical can only be measured at the
            // hands: the push acts over the centre of mass.
            moment_n_m.z += (palm_m - body.com_m).cross(flat(hand_n)).z;
        }
        let largest_turn_n_m =
            scale.moment_n_m(LARGEST_TURN_N_M) - scale.moment_n_m(TURN_LEFT_OUT_N_M) * ahead;
        moment_n_m.z = moment_n_m.z.clamp(-largest_turn_n_m, largest_turn_n_m);
        let pushing_n = push.acceleration_m_s2 * laden.mass_kg;
        force_n += pushing_n;
        moment_n_m += Vector::new(0.0, 0.0, push_lever_m).cross(pushing_n);
        let pulling_n = hands_m_s2 * laden.mass_kg;
        force_n += pulling_n;
        moment_n_m += Vector::new(0.0, 0.0, hands_lever_m).cross(pulling_n);
        let balance_point_m = balanced_m(force_n, moment_n_m);
        let balance_point_m_s = push.growth_m_s3 * ((height_m + push_lever_m) / GRAVITY_M_S2);
        Load {
            force_n,
            moment_n_m,
            balance_point_m,
            weights_point_m,
            balance_point_m_s,
            velocity_m_s: laden.velocity_m_s,
            ahead,
            yield_share,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::observer::ObservedPush;
    use super::*;
    use crate::Sides;
    use crate::body::posed::Posed;

    #[test]
    fn a_robot_stands_under_what_it_carries() {
        let mut body = Posed::standing().body();
        let free = Load::of(&body, &LadenRobot::of(&body), 0.0, ObservedPush::default(), 0.0);
        assert_eq!(
            (free.force_n, free.moment_n_m, free.balance_point_m),
            (Vector::ZERO, Vector::ZERO, body.com_m)
        );

        // Equal weights in both hands act as one in the middle: the common centre of mass.
        let weight_n = 20.0;
        body.hand_reaction_n = Sides::both(Vector::new(0.0, 0.0, -weight_n - DEAD_ZONE_N));
        let loaded = Load::of(&body, &LadenRobot::of(&body), 0.0, ObservedPush::default(), 0.0);
        let palms_m: Vector = body.palms_m().into_iter().sum();
        let robot_n = body.model.mass_kg * GRAVITY_M_S2;
        let common_m = (body.com_m * robot_n + palms_m * weight_n) / (robot_n + 2.0 * weight_n);
        let away_m = loaded.balance_point_m - common_m;
        assert!(away_m.x.abs() < 1e-5 && away_m.y.abs() < 1e-5, "{away_m}");

        // An upward pull, or a weight below the dead zone, is no load.
        body.hand_reaction_n = Sides { left: Vector::Z * 30.0, right: Vector::Z * -0.9 * DEAD_ZONE_N };
        assert_eq!(
            Load::of(&body, &LadenRobot::of(&body), 0.0, ObservedPush::default(), 0.0).force_n,
            Vector::ZERO
        );
    }

    /// A robot at rest swings 3 kg in each hand forward. All moving parts share the momentum.
    #[test]
    fn what_swings_in_the_hands_belongs_to_the_robot() {
        let mut body = Posed::standing().body();
        body.com_velocity_m_s = Vector::ZERO;
        body.palm_velocity_m_s = Sides::both(Vector::X);
        assert_eq!(LadenRobot::of(&body).velocity_m_s, Vector::ZERO, "empty hands");
        body.hand_reaction_n = Sides::both(Vector::new(0.0, 0.0, -3.0 * GRAVITY_M_S2 - DEAD_ZONE_N));
        let laden = LadenRobot::of(&body);
        let mass_kg = body.model.mass_kg + 6.0;
        assert!((laden.mass_kg - mass_kg).abs() < 1e-4, "{}", laden.mass_kg);
        assert!((laden.velocity_m_s - Vector::X * (6.0 / mass_kg)).length() < 1e-5, "{}", laden.velocity_m_s);
    }

    /// A robot leans against a steady push: moments about the pressure point cancel.
    #[test]
    fn a_push_is_leant_against() {
        let body = Posed::standing().body();
        let push_m_s2 = Vector::new(0.5, 0.0, 0.0);
        let push = ObservedPush { acceleration_m_s2: push_m_s2, ..ObservedPush::default() };
        let load = Load::of(&body, &LadenRobot::of(&body), 0.0, push, 0.0);
        let lean_m = body.com_m.x - load.balance_point_m.x;
        let expected_m = -push_m_s2.x * (body.com_m.z + PUSH_LEVER_M) / GRAVITY_M_S2;
        assert!((lean_m - expected_m).abs() < 1e-5, "{lean_m} {expected_m}");
    }
}
