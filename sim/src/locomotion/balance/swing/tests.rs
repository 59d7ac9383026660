//! The path of a foot: ends, speeds, height, reach.

use rapier3d::math::Rotation;

use super::*;
use crate::body::JOINTS;
use crate::body::posed::{Posed, model};

const DT_S: f32 = 1.0 / 200.0;
const START: Pose = Pose::IDENTITY;

fn ahead(x_m: f32) -> Pose {
    Pose::from_translation(Vector::new(x_m, 0.05, 0.0))
}

/// Follows a path to a goal that may change on the way. Returns position and velocity after each physics
/// step.
fn fly(goal: impl Fn(f32) -> Pose, pace: f32) -> (Swing, Vec<(Vector, Vector)>) {
    let mut swing = Swing::at(START);
    let mut path = Vec::new();
    let mut time_s = 0.0;
    while time_s < AIR_S {
        time_s += DT_S * pace;
        swing.advance(goal(time_s), time_s, pace, DT_S);
        path.push((swing.position_m, swing.velocity_m_s));
    }
    (swing, path)
}

#[test]
fn starts_and_ends_at_rest_where_it_should() {
    for (x_m, pace) in [(0.3, 1.0), (-0.2, 1.0), (0.12, 2.0)] {
        let goal = ahead(x_m);
        let (_, path) = fly(|_| goal, pace);
        let (last_m, last_m_s) = path[path.len() - 1];
        let missed_m = (last_m - goal.translation).length();
        assert!(missed_m < 0.006 && last_m_s.length() < 0.25, "{missed_m} m off, at {last_m_s} m/s");
        let fastest_m_s = path.iter().map(|(_, velocity)| velocity.length()).fold(0.0, f32::max);
        let (_, first_m_s) = path[0];
        assert!(first_m_s.length() < 0.1 * fastest_m_s, "starts with {first_m_s}");
        // The minimum-jerk path has 15/8 of the mean speed in the middle.
        let expected_m_s = 1.875 * goal.translation.length() / AIR_S * pace;
        assert!((fastest_m_s / expected_m_s - 1.0).abs() < 0.1, "{fastest_m_s} {expected_m_s}");
    }
}

#[test]
fn a_goal_that_moves_is_followed() {
    let (_, path) = fly(|time_s| ahead(if time_s < 0.1 { 0.1 } else { 0.2 }), 1.0);
    assert!((path[path.len() - 1].0 - ahead(0.2).translation).length() < 0.01);
}

#[test]
fn the_foot_is_lifted_and_set_down_smoothly() {
    for (time_s, height_m) in [(0.0, 0.0), (0.5 * AIR_S, HEIGHT_M), (AIR_S, 0.0)] {
        let [lift_m, lift_m_s, _] = lift(time_s);
        assert!(
            (lift_m - height_m).abs() < 1e-6 && lift_m_s.abs() < 1e-5,
            "at {time_s}: {lift_m} {lift_m_s}"
        );
    }
    let small_s = 1e-3;
    for i in 1..20 {
        let time_s = AIR_S * i as f32 / 20.0;
        let ([below, below_m_s, _], [above, above_m_s, _]) = (lift(time_s - small_s), lift(time_s + small_s));
        let [lift_m, lift_m_s, lift_m_s2] = lift(time_s);
        assert!(lift_m > 0.0);
        assert!((lift_m_s - (above - below) / (2.0 * small_s)).abs() < 2e-3);
        assert!((lift_m_s2 - (above_m_s - below_m_s) / (2.0 * small_s)).abs() < 0.1);
    }
    let [late_m, late_m_s, _] = lift(AIR_S + 0.1);
    assert!(
        (late_m + 0.1 * PROBING_M_S).abs() < 1e-6 && late_m_s == -PROBING_M_S,
        "it probes for the ground"
    );
}

/// Goals within reach are kept. Farther goals are moved to the limit of the reach, which is centred on the
/// end of the path that starts without jerk.
#[test]
fn far_goals_are_brought_within_reach() {
    let mut swing = Swing::at(START);
    let sole_m = swing.sole_m(&BodyScale::G1);
    let most_m = REACH_M_S2 * AIR_S * AIR_S;
    let near_m = sole_m + Vector::new(0.5 * most_m, 0.0, 0.0);
    assert!((swing.reachable_m(&BodyScale::G1, near_m, 0.0, 1.0) - near_m).length() < 1e-6);
    let far_m = sole_m + Vector::new(3.0 * most_m, 0.0, 0.0);
    assert!((swing.reachable_m(&BodyScale::G1, far_m, 0.0, 1.0).x - sole_m.x - most_m).abs() < 1e-5);
    (swing.velocity_m_s, swing.acceleration_m_s2) = (Vector::X, Vector::new(-2.0, 0.0, 0.0));
    let remaining_s = AIR_S - 0.1;
    let resting_m = sole_m.x + 0.6 * remaining_s - 0.15 * 2.0 * remaining_s * remaining_s;
    let back_m = swing.reachable_m(&BodyScale::G1, sole_m - Vector::X * 9.0, 0.1, 1.0).x;
    assert!((back_m - resting_m + REACH_M_S2 * remaining_s * remaining_s).abs() < 1e-5);
}

#[test]
fn the_foot_moves_as_its_joints_say() {
    let (posed, still) = (Posed::tumbling(3), Acceleration::default());
    let [before, after] = [-2e-3, 2e-3].map(|time_s| posed.after(time_s, still, &[0.0; JOINTS]).body());
    for side in Side::BOTH {
        let (_, speed_m_s, spin_rad_s) = foot_motion(&posed.body(), side);
        let (from, to) = (before.world_from_foot(side), after.world_from_foot(side));
        let expected_m_s = (to.translation - from.translation) / 4e-3;
        let expected_rad_s = rotation_vector_rad(to.rotation * from.rotation.inverse()) / 4e-3;
        assert!((speed_m_s - expected_m_s).length() < 2e-3, "{speed_m_s} {expected_m_s}");
        assert!((spin_rad_s - expected_rad_s).length() < 2e-3, "{spin_rad_s} {expected_rad_s}");
    }
}

/// A foot on its path is only accelerated along the path. A foot off its path is pulled back.
#[test]
fn a_foot_off_its_path_is_pulled_back() {
    let body = Posed::standing().body();
    let mut swing = Swing::at(body.world_from_foot(Side::Left));
    let lift_m_s2 = Vector::Z * (32.0 * HEIGHT_M / (AIR_S * AIR_S));
    let on = swing.wanted(&body, Side::Left, 0.0);
    assert!((on.linear_m_s2 - lift_m_s2).length() < 1e-3 && on.angular_rad_s2.length() < 1e-2);
    swing.position_m.x += 0.01;
    swing.from.rotation = Rotation::from_rotation_z(0.02) * swing.from.rotation;
    let off = swing.wanted(&body, Side::Left, 0.0);
    let pulled = Vector::X * (0.01 * STIFFNESS_1_S2);
    assert!((off.linear_m_s2 - lift_m_s2 - pulled).length() < 1e-2, "{}", off.linear_m_s2);
    assert!((off.angular_rad_s2.z - 0.02 * STIFFNESS_1_S2).abs() < 1e-2, "{}", off.angular_rad_s2);
}

/// The path is that of the ankle roll link, footholds are those of the sole.
#[test]
fn the_sole_is_where_the_robots_file_has_it() {
    for (side, sole) in model().soles.by_side() {
        assert_eq!(sole.link_from_site.translation, BodyScale::G1.sole_in_foot_m);
        assert_eq!(sole.link, model().joints[LEGS[side] + LEG_JOINTS - 1].link);
    }
}
