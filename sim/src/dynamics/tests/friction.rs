//! Sliding, spinning and rolling friction against closed forms.

use std::f64::consts::TAU;

use rapier3d::glamx::{DMat3, DPose3, DVec3};
use rapier3d::prelude::SharedShape;

use super::super::{Directions, Friction, Mass, TreeId};
use super::bench::{Bench, DOWN, DT_S, G_M_S2, lone, sliding};

const HALF_M: DVec3 = DVec3::new(0.1, 0.1, 0.05);

/// Builds a box at rest on a floor, with gravity tilted so that the floor slopes towards `azimuth_rad`.
fn on_slope(slope_rad: f64, azimuth_rad: f64, mu: f64) -> (Bench, TreeId) {
    let (sin, cos) = slope_rad.sin_cos();
    let down = DVec3::new(sin * azimuth_rad.cos(), sin * azimuth_rad.sin(), -cos) * G_M_S2;
    let mut bench = Bench::with_floor(down, sliding(mu));
    let at = DPose3::from_translation(DVec3::new(0.0, 0.0, HALF_M.z));
    let body = bench.add_box(1.0, HALF_M, at, sliding(mu));
    (bench, body)
}

/// In eight directions, a box holds at 0.5 degrees below the friction angle. At 0.5 degrees above it, the box
/// slides by the expected distance, straight down the slope.
#[test]
fn dynamics_slopes_at_both_sides_of_the_friction_angle() {
    let mu: f64 = 0.5;
    for eighth in 0..8 {
        let azimuth = TAU * f64::from(eighth) / 8.0 + 0.1;
        let along = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let (mut bench, body) = on_slope(mu.atan() - 0.5f64.to_radians(), azimuth, mu);
        bench.run_s(3.0);
        let held_m = bench.position_m(body).with_z(0.0).length();
        assert!(held_m < 2e-4, "{held_m} m in direction {eighth}");
        let slope = mu.atan() + 0.5f64.to_radians();
        let (mut bench, body) = on_slope(slope, azimuth, mu);
        bench.run_s(3.0);
        let slid_m = bench.position_m(body).with_z(0.0);
        let wanted_m = 0.5 * G_M_S2 * (slope.sin() - mu * slope.cos()) * 9.0;
        assert!((slid_m.dot(along) / wanted_m - 1.0).abs() < 0.05, "{} for {wanted_m}", slid_m.dot(along));
        assert!(slid_m.cross(along).length() < 0.01 * wanted_m, "{slid_m} in direction {eighth}");
    }
}

/// The distance is v^2 / (2 mu g), less half a step: velocities first, then positions.
#[test]
fn dynamics_sliding_distance() {
    for eighth in 0..8 {
        let azimuth = TAU * f64::from(eighth) / 8.0 + 0.3;
        let along = DVec3::new(azimuth.cos(), azimuth.sin(), 0.0);
        let (mut bench, body) = on_slope(0.0, 0.0, 0.5);
        bench.run_s(0.2);
        let from_m = bench.position_m(body);
        let pose = bench.dynamics.tree(body).world_from_link(0);
        bench.dynamics.tree_mut(body).set_base(pose, along, DVec3::ZERO);
        bench.run_s(1.0);
        let slid_m = bench.position_m(body) - from_m;
        let wanted_m = 1.0 / (2.0 * 0.5 * G_M_S2) - 0.5 * DT_S;
        assert!((slid_m.dot(along) / wanted_m - 1.0).abs() < 0.02, "{slid_m} for {wanted_m}");
        assert!(slid_m.with_z(0.0).cross(along).length() < 0.02 * wanted_m, "{slid_m}");
    }
}

fn rolling(roll_m: f64) -> Friction {
    Friction {
        directions: Directions::SlideSpinRoll,
        slide: 0.8,
        spin_m: 0.0,
        roll_m,
        priority: 0,
        left: 1.0,
    }
}

/// Rolls a ball at 0.5 m/s. Returns its distance after `time_s` and its speed at that time.
fn roll(friction: Friction, time_s: f64) -> (f64, f64) {
    let radius_m = 0.05;
    let mut bench = Bench::with_floor(DOWN, friction);
    let ball = bench.add_ball(0.3, radius_m, DVec3::new(0.0, 0.0, radius_m), friction);
    bench.run_s(0.1);
    let pose = bench.dynamics.tree(ball).world_from_link(0);
    let spin = DVec3::new(0.0, 0.5 / radius_m, 0.0);
    bench.dynamics.tree_mut(ball).set_base(pose, DVec3::new(0.5, 0.0, 0.0), spin);
    bench.run_s(time_s);
    let end = bench.dynamics.tree(ball);
    (bench.position_m(ball).x - pose.translation.x, end.link_velocity_m_s(0).length())
}

#[test]
fn dynamics_ball_rolls_on_without_rolling_friction() {
    for friction in [sliding(0.8), rolling(0.0)] {
        let (distance_m, speed_m_s) = roll(friction, 2.0);
        assert!(
            (distance_m - 1.0).abs() < 1e-3 && (speed_m_s - 0.5).abs() < 1e-3,
            "{distance_m} {speed_m_s}"
        );
    }
}

/// The moment is r m g about the contact, where the ball's inertia is 7/5 m R^2:  a = 5/7 r g / R.
#[test]
fn dynamics_ball_comes_to_rest_by_rolling_friction() {
    let roll_m = 0.002;
    let deceleration_m_s2 = 5.0 / 7.0 * roll_m * G_M_S2 / 0.05;
    let wanted_m = 0.25 / (2.0 * deceleration_m_s2);
    let (distance_m, speed_m_s) = roll(rolling(roll_m), 4.0);
    assert!((distance_m / wanted_m - 1.0).abs() < 0.02, "{distance_m} for {wanted_m}");
    assert!(speed_m_s < 1e-6, "{speed_m_s}");
}

/// On a slope a ball accelerates at 5/7 of the rate of a body that slides without friction.
#[test]
fn dynamics_ball_rolls_down_a_slope() {
    let (sin, cos) = 10f64.to_radians().sin_cos();
    let mut bench = Bench::with_floor(DVec3::new(sin, 0.0, -cos) * G_M_S2, sliding(0.8));
    let ball = bench.add_ball(0.3, 0.05, DVec3::new(0.0, 0.0, 0.05), sliding(0.8));
    bench.run_s(2.0);
    let wanted_m = 0.5 * 5.0 / 7.0 * G_M_S2 * sin * 4.0;
    assert!(
        (bench.position_m(ball).x / wanted_m - 1.0).abs() < 0.005,
        "{} {wanted_m}",
        bench.position_m(ball).x
    );
}

/// A ball spins on one point:  I w' = -spin m g.
#[test]
fn dynamics_torsional_friction_stops_a_top() {
    let spin_m = 0.003;
    let friction = Friction {
        directions: Directions::SlideSpin,
        slide: 0.8,
        spin_m,
        roll_m: 0.0,
        priority: 0,
        left: 1.0,
    };
    let mut bench = Bench::with_floor(DOWN, friction);
    let ball = bench.add_ball(0.3, 0.05, DVec3::new(0.0, 0.0, 0.05), friction);
    bench.run_s(0.1);
    let pose = bench.dynamics.tree(ball).world_from_link(0);
    bench.dynamics.tree_mut(ball).set_base(pose, DVec3::ZERO, DVec3::new(0.0, 0.0, 20.0));
    let slowing_rad_s2 = spin_m * G_M_S2 / (0.4 * 0.05 * 0.05);
    bench.run_s(0.5);
    let spin = bench.dynamics.tree(ball).link_spin_rad_s(0);
    let wanted = 20.0 - 0.5 * slowing_rad_s2;
    assert!((spin.z / wanted - 1.0).abs() < 0.01 && spin.with_z(0.0).length() < 1e-3, "{spin} for {wanted}");
    bench.run_s(1.0);
    assert!(bench.dynamics.tree(ball).link_spin_rad_s(0).length() < 1e-6);
}

/// A disc rests on the points of its rim:  I w' = -mu m g R.
#[test]
fn dynamics_disc_stops_spinning() {
    let (radius_m, half_m, mass_kg) = (0.1, 0.02, 1.0);
    let (axial, across) = (0.5 * radius_m * radius_m, 0.25 * radius_m * radius_m + half_m * half_m / 3.0);
    let inertia_kg_m2 = DMat3::from_diagonal(DVec3::new(across, axial, across) * mass_kg);
    let turn = rapier3d::glamx::DQuat::from_rotation_x(TAU / 4.0);
    let at = DPose3::from_parts(DVec3::new(0.0, 0.0, half_m), turn);
    let mut bench = Bench::with_floor(DOWN, sliding(0.3));
    let disc = bench.add(lone("disc", at, Mass { mass_kg, com_m: DVec3::ZERO, inertia_kg_m2 }));
    let shape = SharedShape::cylinder(half_m as f32, radius_m as f32);
    bench.add_shape(disc.link(0), shape, sliding(0.3));
    bench.run_s(0.1);
    let pose = bench.dynamics.tree(disc).world_from_link(0);
    bench.dynamics.tree_mut(disc).set_base(pose, DVec3::ZERO, DVec3::new(0.0, 0.0, 20.0));
    bench.run_s(0.2);
    let wanted = 20.0 - 0.2 * 0.3 * G_M_S2 / (0.5 * radius_m);
    let spin = bench.dynamics.tree(disc).link_spin_rad_s(0).z;
    assert!((spin / wanted - 1.0).abs() < 0.05, "{spin} for {wanted}");
    bench.run_s(0.5);
    assert!(bench.dynamics.tree(disc).link_spin_rad_s(0).length() < 1e-4);
}

/// MJCF's rule: the values of the higher priority, otherwise the larger of each.
#[test]
fn dynamics_friction_of_a_pair() {
    let floor = Friction {
        directions: Directions::Slide,
        slide: 1.0,
        spin_m: 0.0,
        roll_m: 0.0001,
        priority: 0,
        left: 1.0,
    };
    let ball = Friction {
        directions: Directions::SlideSpinRoll,
        slide: 0.4,
        spin_m: 0.01,
        roll_m: 0.0,
        priority: 0,
        left: 1.0,
    };
    let both = Friction::between(&floor, &ball);
    assert_eq!(both.lanes(), [1.0, 1.0, 1.0, 0.01, 0.0001, 0.0001]);
    let sole = Friction { slide: 0.6, priority: 1, ..floor };
    assert_eq!(Friction::between(&sole, &ball), sole);
    assert_eq!(Friction::between(&ball, &sole), sole);
    // The share `left` applies to the combined friction, whichever collider's values are used.
    let greasy = Friction { left: 0.5, ..ball };
    assert_eq!(Friction::between(&greasy, &sole), Friction { slide: 0.3, roll_m: 0.00005, ..sole });
    assert_eq!(Friction::between(&greasy, &greasy).lanes(), [1.0, 0.1, 0.1, 0.0025, 0.0, 0.0]);
}

#[test]
fn dynamics_kinds_of_contact_are_mjcfs() {
    use Directions::{None as Normal, Slide, SlideSpin, SlideSpinRoll};
    let read = [0, 1, 2, 3, 4, 5, 6, 7].map(Directions::from_condim);
    assert_eq!(
        read,
        [None, Some(Normal), None, Some(Slide), Some(SlideSpin), None, Some(SlideSpinRoll), None]
    );
}
