//! Motion without contacts.

use rapier3d::glamx::{DMat3, DPose3, DVec3};

use super::super::{Drive, Joint, Mass};
use super::bench::{Bench, DOWN, DT_S, G_M_S2, Random, bush, lone, momentum, stir};

#[test]
fn dynamics_free_fall() {
    let mut bench = Bench::new(DOWN);
    let body = bench.add(lone("stone", DPose3::IDENTITY, Mass::of_box(2.0, DVec3::new(0.1, 0.2, 0.3))));
    bench.dynamics.tree_mut(body).set_base(DPose3::IDENTITY, DVec3::X, DVec3::ZERO);
    bench.run_s(1.0);
    // Velocities first, then positions: the distance is half a step ahead.
    let fallen_m = 0.5 * G_M_S2 * (1.0 + DT_S);
    let wanted_m = DVec3::new(1.0, 0.0, -fallen_m);
    assert!((bench.position_m(body) - wanted_m).length() < 1e-12, "{}", bench.position_m(body));
}

/// A tumbling body keeps its angular momentum, its energy and the path of its centre of mass.
#[test]
fn dynamics_tumbling_body() {
    let mut bench = Bench::new(DVec3::ZERO);
    let mass = Mass {
        mass_kg: 1.5,
        com_m: DVec3::new(0.1, -0.05, 0.2),
        inertia_kg_m2: DMat3::from_diagonal(DVec3::new(0.01, 0.02, 0.028)),
    };
    let body = bench.add(lone("racket", DPose3::IDENTITY, mass));
    // The rotation is about the middle axis, which is unstable.
    bench.dynamics.tree_mut(body).set_base(DPose3::IDENTITY, DVec3::ZERO, DVec3::new(0.05, 10.0, 0.02));
    let (linear, angular) = momentum(bench.dynamics.tree(body));
    let energy_j = bench.energy_j(body);
    let mut turned_over = false;
    let mut worst = (0.0f64, 0.0f64, 0.0f64);
    for _ in 0..4000 {
        bench.step();
        let tree = bench.dynamics.tree(body);
        let (p, l) = momentum(tree);
        worst.0 = worst.0.max((p - linear).length() / linear.length());
        worst.1 = worst.1.max((l - angular).length() / angular.length());
        worst.2 = worst.2.max((bench.energy_j(body) - energy_j).abs() / energy_j);
        turned_over |= (tree.world_from_link(0).rotation.inverse() * tree.link_spin_rad_s(0)).y < -5.0;
    }
    assert!(turned_over, "the middle axis is unstable");
    assert!(worst.0 < 1e-9 && worst.1 < 5e-3 && worst.2 < 1e-9, "{worst:?}");
}

/// Drives inside a floating tree change its momentum only by the integration error.
#[test]
fn dynamics_thrashing_tree_keeps_its_momentum() {
    let mut random = Random(7);
    let mut bench = Bench::new(DVec3::ZERO);
    let mut tree = bush(Joint::Free, &mut random);
    stir(&mut tree, &mut random, 0.3);
    let id = bench.add(tree);
    let (linear, angular) = momentum(bench.dynamics.tree(id));
    let mut size = (0.0f64, 0.0f64);
    for step in 0..400 {
        let tree = bench.dynamics.tree_mut(id);
        for link in 0..tree.links().len() {
            let target = 0.5 * (step as f64 * 0.03 + link as f64).sin();
            tree.drive(link, Drive { target, kp: 40.0, kd: 1.0, feedforward: 0.0 });
        }
        bench.step();
        let tree = bench.dynamics.tree(id);
        let fastest =
            (0..tree.links().len()).map(|link| tree.link_velocity_m_s(link).length()).fold(0.0, f64::max);
        size.0 = size.0.max(fastest * tree.mass_kg());
        size.1 = size.1.max(fastest * tree.mass_kg() * 0.5);
    }
    let (p, l) = momentum(bench.dynamics.tree(id));
    let (dp, dl) = ((p - linear).length() / size.0, (l - angular).length() / size.1);
    assert!(dp < 0.01 && dl < 0.01, "{dp} {dl}");
}

/// A tree that whirls without external forces keeps its momentum and gains no energy.
#[test]
fn dynamics_whirling_tree_gains_no_energy() {
    for (fast, seed) in [(40.0, 12), (150.0, 13)] {
        let mut random = Random(seed);
        let mut bench = Bench::new(DVec3::ZERO);
        let mut tree = bush(Joint::Free, &mut random);
        stir(&mut tree, &mut random, fast);
        tree.set_base(DPose3::IDENTITY, DVec3::ZERO, DVec3::ZERO);
        let id = bench.add(tree);
        let kinetic_j = |bench: &Bench| {
            let tree = bench.dynamics.tree(id);
            let armature = |link: usize| tree.links()[link].joint.axis().map_or(0.0, |axis| axis.armature);
            let drives = (0..tree.links().len()).map(|i| armature(i) * tree.joint_velocity(i).powi(2));
            bench.energy_j(id) + 0.5 * drives.sum::<f64>()
        };
        let (linear, angular) = momentum(bench.dynamics.tree(id));
        let (first_j, mut before_j) = (kinetic_j(&bench), kinetic_j(&bench));
        for _ in 0..1000 {
            bench.step();
            let now_j = kinetic_j(&bench);
            assert!(now_j < before_j * 1.01, "{now_j} J after {before_j} J");
            before_j = now_j;
        }
        assert!(before_j < first_j, "{before_j} J of {first_j} J");
        let (p, l) = momentum(bench.dynamics.tree(id));
        let (dp, dl) = ((p - linear).length() / linear.length(), (l - angular).length() / angular.length());
        assert!(dp < 1e-9 && dl < 1e-9, "{dp} {dl}");
    }
}
