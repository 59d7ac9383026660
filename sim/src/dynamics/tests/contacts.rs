//! Tests of stacks, unequal masses, impacts, and reports of contacts.

use rapier3d::glamx::{DPose3, DQuat, DVec3};

use super::bench::{Bench, DOWN, DT_S, G_M_S2, sliding};

#[test]
fn dynamics_stack_of_eight_boxes_stands() {
    let half_m = DVec3::splat(0.05);
    let mut bench = Bench::with_floor(DOWN, sliding(0.6));
    let boxes: Vec<_> = (0..8)
        .map(|level| {
            let aside_m = 0.004 * f64::from(level % 3 - 1);
            let at = DVec3::new(aside_m, -aside_m, 0.05 + 0.1 * f64::from(level));
            bench.add_box(1.0, half_m, DPose3::from_translation(at), sliding(0.6))
        })
        .collect();
    let place = |bench: &Bench| boxes.iter().map(|id| bench.position_m(*id)).collect::<Vec<DVec3>>();
    let built = place(&bench);
    bench.run_s(2.0);
    let settled = place(&bench);
    bench.run_s(8.0);
    for (level, after) in place(&bench).into_iter().enumerate() {
        // Contacts are soft: those at the bottom yield by a millimetre under the weight of the others.
        let (sunk_m, crept_m) = (after - built[level], after - settled[level]);
        assert!(sunk_m.length() < 0.0015 * (level + 1) as f64, "box {level} moved by {sunk_m}");
        assert!(crept_m.length() < 3e-4, "box {level} crept by {crept_m}");
    }
}

/// Contacts are soft in proportion to the mass of the lighter body. A hundred times its weight presses the
/// light box in by some millimetres, at once and no further.
#[test]
fn dynamics_light_box_bears_a_hundred_times_its_weight() {
    let half_m = DVec3::splat(0.05);
    let mut bench = Bench::with_floor(DOWN, sliding(0.6));
    let light =
        bench.add_box(0.1, half_m, DPose3::from_translation(DVec3::new(0.0, 0.0, 0.05)), sliding(0.6));
    let heavy =
        bench.add_box(10.0, half_m, DPose3::from_translation(DVec3::new(0.0, 0.0, 0.15)), sliding(0.6));
    bench.run_s(2.0);
    let settled_m = [light, heavy].map(|id| bench.position_m(id));
    bench.run_s(3.0);
    for (id, settled_m) in [light, heavy].into_iter().zip(settled_m) {
        let crept_m = bench.position_m(id) - settled_m;
        assert!(crept_m.length() < 1e-3, "{crept_m}");
    }
    assert!((bench.position_m(light) - DVec3::new(0.0, 0.0, 0.05)).length() < 3e-3);
    assert!((bench.position_m(heavy) - DVec3::new(0.0, 0.0, 0.15)).length() < 12e-3);
}

fn tilted(x_m: f64, z_m: f64, turn_rad: DVec3) -> DPose3 {
    DPose3::from_parts(DVec3::new(x_m, 0.0, z_m), DQuat::from_scaled_axis(turn_rad))
}

/// A box that falls on a corner, tumbles and comes to rest loses energy all the way.
#[test]
fn dynamics_impacts_do_not_gain_energy() {
    for turn_rad in [DVec3::new(0.4, 0.7, 0.1), DVec3::new(-0.3, 0.2, 0.5), DVec3::new(0.0, 0.8, 0.0)] {
        let mut bench = Bench::with_floor(DOWN, sliding(0.5));
        let half_m = DVec3::new(0.1, 0.07, 0.04);
        let body = bench.add_box(1.0, half_m, tilted(0.0, 0.5, turn_rad), sliding(0.5));
        let start_j = bench.energy_j(body);
        let mut last_j = start_j;
        for step in 0..600 {
            bench.step();
            let now_j = bench.energy_j(body);
            // Correcting penetration lifts the box by a fraction of a millimetre.
            assert!(now_j < last_j + 2e-3 * start_j, "{now_j} after {last_j} J in step {step}");
            last_j = now_j;
        }
        assert!(bench.dynamics.tree(body).link_velocity_m_s(0).length() < 1e-3);
    }
}

/// Bodies of unequal mass that fall on each other end at rest and never have more energy than at the start.
#[test]
fn dynamics_pile_comes_to_rest() {
    let mut bench = Bench::with_floor(DOWN, sliding(0.5));
    let half_m = DVec3::new(0.1, 0.07, 0.04);
    let bodies = [
        bench.add_box(1.0, half_m, tilted(0.0, 0.5, DVec3::new(0.4, 0.7, 0.1)), sliding(0.5)),
        bench.add_box(0.2, half_m, tilted(0.05, 0.9, DVec3::new(-0.3, 0.2, 0.5)), sliding(0.5)),
        bench.add_box(2.0, half_m, tilted(-0.02, 1.3, DVec3::new(0.1, 0.9, -0.5)), sliding(0.5)),
    ];
    let energy_j = |bench: &Bench| bodies.iter().map(|id| bench.energy_j(*id)).sum::<f64>();
    let start_j = energy_j(&bench);
    for step in 0..800 {
        bench.step();
        assert!(energy_j(&bench) < 1.001 * start_j, "step {step}");
    }
    for id in bodies {
        assert!(bench.dynamics.tree(id).link_velocity_m_s(0).length() < 1e-2);
    }
}

/// A ball at 5 m/s neither bounces off the floor nor passes through it.
#[test]
fn dynamics_fast_ball_stops_at_the_floor() {
    let mut bench = Bench::with_floor(DOWN, sliding(0.5));
    let ball = bench.add_ball(0.4, 0.04, DVec3::new(0.0, 0.0, 0.3), sliding(0.5));
    let pose = bench.dynamics.tree(ball).world_from_link(0);
    bench.dynamics.tree_mut(ball).set_base(pose, DVec3::new(0.0, 0.0, -5.0), DVec3::ZERO);
    let (mut lowest, mut fastest) = (f64::MAX, f64::MIN);
    for _ in 0..200 {
        bench.step();
        lowest = f64::min(lowest, bench.position_m(ball).z);
        fastest = f64::max(fastest, bench.dynamics.tree(ball).link_velocity_m_s(0).z);
    }
    assert!(lowest > 0.03 && fastest < 0.05, "{lowest} {fastest}");
    assert!((bench.position_m(ball).z - 0.04).abs() < 1e-3);
}

/// A resting box is held by a force equal to its weight, and the contacts report it.
#[test]
fn dynamics_contacts_report_the_weight() {
    let mut bench = Bench::with_floor(DOWN, sliding(0.5));
    let at = DPose3::from_translation(DVec3::new(0.3, 0.0, 0.05));
    let body = bench.add_box(2.0, DVec3::splat(0.05), at, sliding(0.5));
    bench.run_s(1.0);
    let centre_m = bench.position_m(body);
    bench.dynamics.tree_mut(body).push(0, centre_m, DVec3::new(4.0, 0.0, 0.0));
    bench.step();
    let collider = bench.dynamics.solver.touches[0].colliders[1];
    let force: DVec3 = bench.dynamics.forces_on(collider).map(|(_, force)| force).sum();
    assert!((force - DVec3::new(-4.0, 0.0, 2.0 * G_M_S2)).length() < 0.05, "{force}");
    let normal: f64 = bench.dynamics.solver.touches.iter().map(|touch| touch.normal_impulse_n_s).sum();
    assert!((normal / DT_S - 2.0 * G_M_S2).abs() < 0.05);
    assert_eq!(bench.dynamics.solver.touches.len(), 4);
}

/// An endless floor carries a body at any distance exactly like at its centre.
#[test]
fn dynamics_endless_floor_carries_everywhere() {
    let settled = |x_m: f64| {
        let mut bench = Bench::new(DOWN);
        bench.add_endless_floor(sliding(0.5));
        let at = DPose3::from_translation(DVec3::new(x_m, -2.0 * x_m, 0.3));
        let body = bench.add_box(3.0, DVec3::new(0.2, 0.1, 0.05), at, sliding(0.5));
        bench.dynamics.tree_mut(body).set_base(at, DVec3::X, DVec3::ZERO);
        bench.run_s(2.0);
        let place_m = bench.position_m(body);
        assert!((place_m.z - 0.05).abs() < 1e-3, "{place_m}");
        place_m.x - x_m
    };
    let slid_m = settled(0.0);
    // At 15.9 m it slides from one part of the floor to the next.
    for x_m in [15.9, 60.0, -700.0] {
        assert!((settled(x_m) - slid_m).abs() < 1e-3, "{} {slid_m}", settled(x_m));
    }
}
