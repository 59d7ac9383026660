//! Tests of bit-identical reruns for any history of Rapier's broad phase, and of errors for non-finite
//! numbers.

use rapier3d::glamx::{DPose3, DVec3};
use rapier3d::prelude::SharedShape;

use super::super::{Drive, DynamicsState, Equality, Joint, TreeState};
use super::bench::{Bench, DOWN, Random, bush, sliding, stir};

/// Builds a scene of boxes, balls and a tree that fall on each other.
fn scene() -> Bench {
    let mut bench = Bench::new(DOWN);
    bench.add_slab(5.0, sliding(0.6));
    let mut random = Random(11);
    for level in 0..6 {
        let at = random.vector() * 0.05 + DVec3::new(0.0, 0.0, 0.3 + 0.2 * f64::from(level));
        if level % 2 == 0 {
            let half_m = DVec3::new(0.08, 0.06, 0.05);
            bench.add_box(1.0, half_m, DPose3::from_translation(at), sliding(0.6));
        } else {
            bench.add_ball(0.5, 0.06, at, sliding(0.6));
        }
    }
    let mut tree = bush(Joint::Free, &mut random);
    stir(&mut tree, &mut random, 1.0);
    tree.set_base(DPose3::from_translation(DVec3::new(0.3, 0.0, 1.0)), DVec3::ZERO, DVec3::ZERO);
    let links = tree.links().len();
    for link in 0..links {
        tree.drive(link, Drive { target: 0.2, kp: 5.0, kd: 0.2, feedforward: 0.0 });
    }
    let tree = bench.add(tree);
    for link in 0..links {
        bench.add_shape(tree.link(link), SharedShape::ball(0.05), sliding(0.6));
    }
    let [a, b] = [tree.link(5), tree.link(12)];
    let pose = |id: super::super::LinkId| bench.dynamics.tree(tree).world_from_link(id.link);
    let a_point_m = pose(a).inverse() * pose(b).translation;
    let held = Equality::Connect { a, a_point_m, b: Some(b), b_point_m: DVec3::ZERO };
    bench.dynamics.add_equality(held, true);
    bench
}

fn bits(bench: &Bench) -> Vec<u8> {
    postcard::to_stdvec(&bench.dynamics.state().trees).expect("plain numbers")
}

#[test]
fn dynamics_reruns_are_equal_to_the_bit() {
    let (mut first, mut second) = (scene(), scene());
    first.run_s(2.0);
    second.run_s(2.0);
    assert_eq!(bits(&first), bits(&second));
    assert!(!first.dynamics.solver.touches.is_empty());
}

/// Contacts depend neither on pairs that were near before, nor on the order in which they came near.
#[test]
fn dynamics_the_past_of_the_broad_phase_does_not_matter() {
    let (mut first, mut second) = (scene(), scene());
    let start = second.dynamics.state();
    for tree in 0..6_u16 {
        let at = DPose3::from_translation(DVec3::new(0.1 * f64::from(6 - tree), 0.0, 0.06));
        let tree = second.dynamics.tree_mut(super::super::TreeId(tree));
        tree.set_base(at, DVec3::X, DVec3::Y);
    }
    second.run_s(0.5);
    second.dynamics.restore(&start).unwrap();
    for step in 0..400 {
        first.step();
        second.step();
        assert_eq!(bits(&first), bits(&second), "step {step}");
    }
}

#[test]
fn dynamics_restored_worlds_go_on_as_they_would_have() {
    let mut first = scene();
    first.run_s(0.8);
    let state = postcard::to_stdvec(&first.dynamics.state()).unwrap();
    first.run_s(1.0);
    let mut second = scene();
    second.run_s(0.1);
    let state: DynamicsState = postcard::from_bytes(&state).unwrap();
    second.dynamics.restore(&state).unwrap();
    second.run_s(1.0);
    assert_eq!(bits(&first), bits(&second));
    assert!(Bench::new(DOWN).dynamics.restore(&state).is_err());
}

/// A force that is NaN ends the step with an error that names the tree. The state is unchanged.
#[test]
fn dynamics_divergence_is_an_error_and_changes_nothing() {
    let mut bench = scene();
    bench.run_s(0.5);
    let before: Vec<TreeState> = bench.dynamics.state().trees;
    let touches = postcard::to_stdvec(&bench.dynamics.solver.touches).unwrap();
    let body = super::super::TreeId(2);
    for bad in [f64::NAN, f64::INFINITY, 1e300] {
        bench.dynamics.tree_mut(body).push(0, DVec3::ZERO, DVec3::new(bad, 0.0, 0.0));
        let error = bench.dynamics.step().unwrap_err();
        assert!(error.to_string().contains(&error.tree), "{error}");
        assert_eq!(bench.dynamics.state().trees, before);
        assert_eq!(postcard::to_stdvec(&bench.dynamics.solver.touches).unwrap(), touches);
    }
    bench.step();
}
