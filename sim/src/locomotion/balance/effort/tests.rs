//! Leg torques against statics, the pendulum and known ground forces.

use super::*;
use crate::body::posed::Posed;
use crate::locomotion::balance::load::LadenRobot;
use crate::locomotion::balance::observer::ObservedPush;

const STILL: WantedMotion =
    WantedMotion { lift_m_s2: 0.0, turn_rad_s2: Vector::ZERO, feet: Sides::both(AT_REST) };
const AT_REST: Acceleration = Acceleration { linear_m_s2: Vector::ZERO, angular_rad_s2: Vector::ZERO };

fn solve(body: &BodyEstimate, motion: &WantedMotion, pressure_m: Vector, foot: Option<Side>) -> LegTorques {
    let load = Load::of(body, &LadenRobot::of(body), 0.0, ObservedPush::default(), 0.0);
    leg_torques_within_limits(body, &load, motion, &GroundContact { pressure_m: flat(pressure_m), foot })
}

/// The robot stands on one foot under the centre of mass. Each joint of that leg carries everything
/// above it, and the other leg hangs.
#[test]
fn one_leg_holds_the_rest_of_the_robot() {
    let body = Posed::standing().body();
    let torques = solve(&body, &STILL, body.com_m, Some(Side::Left));
    assert!(torques.acceleration_m_s2.length() < 1e-3, "{}", torques.acceleration_m_s2);
    let gravity_n_m = body.gravity_torques_n_m();
    for i in 0..LEG_JOINTS {
        let hanging_n_m = gravity_n_m[LEGS[Side::Right] + i];
        assert!((torques.torque_n_m[Side::Right][i] - hanging_n_m).abs() < 0.02);

        // The links from this joint down to the foot are adjacent in the file.
        let joint = LEGS[Side::Left] + i;
        let below = body.model.joints[joint].link..=body.model.joints[LEGS[Side::Left] + 5].link;
        let (origin_m, axis) = body.joint_axis(joint);
        let mut expected_n_m = 0.0;
        for (index, link) in body.model.links.iter().enumerate().filter(|(index, _)| !below.contains(index)) {
            let lever_m = body.world_from_link[index] * link.mass.local_com - origin_m;
            let weight_n = Vector::Z * (-GRAVITY_M_S2 * link.mass.mass());
            expected_n_m += axis.dot(lever_m.cross(weight_n));
        }
        let torque_n_m = torques.torque_n_m[Side::Left][i];
        assert!((torque_n_m - expected_n_m).abs() < 0.05, "{i}: {torque_n_m} N m, not {expected_n_m}");
    }
}

/// The linear inverted pendulum: a centre of pressure that is off by d accelerates the robot by g d / h,
/// away from it.
#[test]
fn the_robot_falls_away_from_the_pressure() {
    let body = Posed::standing().body();
    for away_m in [Vector::new(0.04, 0.0, 0.0), Vector::new(-0.03, 0.02, 0.0)] {
        let acceleration_m_s2 = solve(&body, &STILL, body.com_m - away_m, None).acceleration_m_s2;
        let expected_m_s2 = away_m * (GRAVITY_M_S2 / body.com_m.z);
        // The stance legs move less than the trunk, so the robot accelerates a little less than a point mass.
        let part = acceleration_m_s2.length() / expected_m_s2.length();
        assert!((0.8..1.0).contains(&part), "{acceleration_m_s2}, not {expected_m_s2}");
        let across = acceleration_m_s2.cross(expected_m_s2).length() / expected_m_s2.length();
        assert!(across < 0.1 * acceleration_m_s2.length(), "{acceleration_m_s2}, not along {expected_m_s2}");
    }
}

#[test]
fn torques_ease_off_rather_than_saturate() {
    let body = Posed::standing().body();
    let kick = Acceleration { linear_m_s2: Vector::new(70.0, 0.0, 20.0), ..AT_REST };
    let motion = WantedMotion { feet: Sides { left: AT_REST, right: kick }, ..STILL };
    let contact = GroundContact { pressure_m: flat(body.com_m), foot: Some(Side::Left) };
    let load = Load::of(&body, &LadenRobot::of(&body), 0.0, ObservedPush::default(), 0.0);
    let most_used = |torques: &LegTorques| {
        let used = torques.torque_n_m.by_side().flat_map(|(side, leg)| {
            let joints = &body.model.joints[LEGS[side]..];
            std::iter::zip(leg, joints)
                .map(|(torque, joint)| torque.abs() / joint.effort_n_m)
                .collect::<Vec<_>>()
        });
        used.fold(0.0, f32::max)
    };
    let (full, eased) = (
        leg_torques(&body, &load, &motion, &contact),
        leg_torques_within_limits(&body, &load, &motion, &contact),
    );
    assert!(most_used(&full) > 1.0, "the kick uses {}", most_used(&full));
    assert!((most_used(&eased) - EFFORT_USED).abs() < 1e-3, "eased, it uses {}", most_used(&eased));
}

/// The ground force is recovered from the torques against it, except for the damping, which removes much
/// of a force along a straight leg.
#[test]
fn a_ground_force_is_recovered() {
    let body = Posed::standing().body();
    let dynamics_n_m = body.gravity_torques_n_m();
    for side in Side::BOTH {
        let force_n = Vector::new(12.0, -8.0, 160.0);
        let foot_m = body.world_from_foot(side).translation;
        let pushed = FootForce { force_n, point_m: foot_m };
        let pushes_n_m = leg_torques_n_m(&body, side, pushed, Vector::ZERO);
        let torque_n_m = std::array::from_fn(|i| dynamics_n_m[LEGS[side] + i] + pushes_n_m[i]);
        let found_n = ground_force_n(&body, side, &dynamics_n_m, &torque_n_m);
        let error_n = flat(found_n - force_n).length();
        assert!(error_n < 0.05 * flat(force_n).length(), "{found_n}, not {force_n}");
        assert!((0.5..1.0).contains(&(found_n.z / force_n.z)), "{found_n}, not {force_n}");
    }
}
