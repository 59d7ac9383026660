//! The energy balance of a step: energy removed by friction, and spurious energy.

use rapier3d::glamx::{DPose3, DVec3};

use super::super::{EnergyBalance, Joint};
use super::bench::{Bench, DOWN, Random, bush, sliding, stir};

fn sum(balances: &[EnergyBalance], of: impl Fn(&EnergyBalance) -> f64) -> f64 {
    balances.iter().map(of).sum()
}

fn made(balance: &EnergyBalance) -> f64 {
    balance.made.iter().sum()
}

/// Returns the present kinetic energy of all trees.
fn kinetic(bench: &Bench) -> f64 {
    bench.dynamics.energy_balance(&bench.dynamics.energy_before()).kinetic
}

/// Runs steps and measures their energy balance. Calls `meddle` between the step and the measurement.
fn measured(bench: &mut Bench, steps: usize, mut meddle: impl FnMut(&mut Bench)) -> Vec<EnergyBalance> {
    let step = |_| {
        let before = bench.dynamics.energy_before();
        bench.step();
        meddle(bench);
        bench.dynamics.energy_balance(&before)
    };
    (0..steps).map(step).collect()
}

#[test]
fn dynamics_friction_takes_all_of_a_sliding_box() {
    let mut bench = Bench::with_floor(DOWN, sliding(0.4));
    let half_m = DVec3::new(0.2, 0.2, 0.05);
    let at = DPose3::from_translation(DVec3::Z * 0.05);
    let id = bench.add_box(2.0, half_m, at, sliding(0.4));
    bench.dynamics.tree_mut(id).set_base(at, DVec3::X * 2.0, DVec3::ZERO);
    let balances = measured(&mut bench, 200, |_| {});
    assert!((balances[0].kinetic - 4.0).abs() < 1e-9, "{}", balances[0].kinetic);
    let taken = sum(&balances, |balance| balance.taken);
    assert!((taken + 4.0).abs() < 0.08, "friction took {taken} J of 4 J");
    let made = sum(&balances, |balance| made(balance).abs());
    assert!(made < 0.04, "{made} J of 4 J came from nothing or went there");
}

#[test]
fn dynamics_a_tree_that_swings_makes_little_and_what_is_added_is_seen() {
    let mut random = Random(11);
    let mut bench = Bench::new(DOWN);
    let mut tree = bush(Joint::Fixed, &mut random);
    stir(&mut tree, &mut random, 1.0);
    let id = bench.add(tree);
    let balances = measured(&mut bench, 100, |_| {});
    let put_in = balances[0].kinetic + sum(&balances, |balance| balance.put_in);
    let (little, taken) = (sum(&balances, made), sum(&balances, |balance| balance.taken));
    assert!(little.abs() < 0.02 * put_in, "{little} J of {put_in} J");
    assert!(taken.abs() < 1e-6 * put_in, "nothing touches it: {taken} J of {put_in} J");

    let last = bench.dynamics.tree(id).links().len() - 1;
    let mut added = 0.0;
    let seen = measured(&mut bench, 1, |bench| {
        let before = kinetic(bench);
        let tree = bench.dynamics.tree_mut(id);
        tree.set_joint(last, tree.joint_position(last), 2.0 * tree.joint_velocity(last) + 20.0);
        added = kinetic(bench) - before;
    });
    let seen = made(&seen[0]);
    assert!(added > 1.0 && (seen - added).abs() < 0.1 * added, "{seen} J of {added} J");
}
