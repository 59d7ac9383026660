//! Drives respect their limits of effort and speed, and report the efforts that act.

use rapier3d::glamx::{DPose3, DVec3};

use super::super::trees::energy::FAST_RAD;
use super::super::{Axis, Drive, Joint, Mass, Tree};
use super::bench::{Bench, DOWN, DT_S, Random, jointed, link, sliding};
use super::inverse::efforts;

/// Far from its target a drive exerts its limit, and the reported effort explains the change of momentum.
#[test]
fn dynamics_drive_saturates() {
    let mass = Mass::of_box(3.0, DVec3::splat(0.1));
    let inertia = mass.inertia_kg_m2.z_axis.z + 0.02;
    let mut axis = Axis::along(DVec3::Z);
    (axis.armature, axis.effort_limit) = (0.02, 5.0);
    let mut bench = Bench::new(DOWN);
    let id = bench.add(jointed(Joint::Hinge(axis), mass));
    let drive = Drive { target: 2.0, kp: 200.0, kd: 20.0, feedforward: 0.0 };
    bench.dynamics.tree_mut(id).drive(0, drive);
    let mut limited = 0;
    for _ in 0..400 {
        let before = bench.dynamics.tree(id).joint_velocity(0);
        bench.step();
        let tree = bench.dynamics.tree(id);
        let (acted, told) = (inertia * (tree.joint_velocity(0) - before) / DT_S, tree.drive_effort(0));
        assert!((acted - told).abs() < 1e-9, "{acted} {told}");
        assert!(told.abs() <= 5.0 * (1.0 + 1e-8), "{told}");
        limited += usize::from(told.abs() > 4.999);
    }
    assert!(limited > 15, "{limited}");
    assert!((bench.dynamics.tree(id).joint_position(0) - 2.0).abs() < 1e-3);
}

/// A floating chain on the floor stays within its effort limits although all drives demand more.
#[test]
fn dynamics_saturated_chain_on_the_floor() {
    let (limited, _) = saturated_chain(0.4, 0.003, 600);
    assert!(limited > 500, "{limited}");
}

/// A chain that falls from a height, too heavy to become fast, also satisfies inverse dynamics.
#[test]
fn dynamics_saturated_chain_in_the_air() {
    let (limited, checked) = saturated_chain(100.0, 0.5, 80);
    assert!(limited > 100 && checked > 70, "{limited} {checked}");
}

/// Returns the number of efforts at their limits, and the number of steps in which all efforts match
/// inverse dynamics.
fn saturated_chain(height_m: f64, armature: f64, steps: usize) -> (usize, usize) {
    let limit = 4.0;
    let mut links =
        vec![link(None, DVec3::new(0.0, 0.0, height_m), Joint::Free, Mass::of_box(2.0, DVec3::splat(0.05)))];
    for index in 1..7 {
        let mut axis = Axis::along([DVec3::X, DVec3::Y, DVec3::new(0.0, 1.0, 1.0)][index % 3]);
        (axis.armature, axis.effort_limit) = (armature, limit);
        let mass = Mass::of_box(0.7, DVec3::new(0.05, 0.03, 0.03));
        links.push(link(Some(index - 1), DVec3::new(0.12, 0.0, 0.0), Joint::Hinge(axis), mass));
    }
    let mut bench = Bench::with_floor(DOWN, sliding(0.7));
    let id = bench.add(Tree::new("chain", links).unwrap());
    for index in [0, 3, 6] {
        let ball = rapier3d::prelude::SharedShape::ball(0.05);
        bench.add_shape(id.link(index), ball, sliding(0.7));
    }
    let mut random = Random(3);
    let (mut limited, mut checked) = (0, 0);
    for step in 0..steps {
        if step % 20 == 0 {
            for link in 1..7 {
                let drive = Drive { target: 2.0 * random.number(), kp: 150.0, kd: 5.0, feedforward: 0.0 };
                bench.dynamics.tree_mut(id).drive(link, drive);
            }
        }
        let (at, before) = (bench.dynamics.tree(id).state(), bench.dynamics.tree(id).v.clone());
        bench.step();
        let tree = bench.dynamics.tree(id);
        for link in 1..7 {
            let told = tree.drive_effort(link);
            assert!(told.abs() <= limit * (1.0 + 1e-8), "{told} at link {link}");
            limited += usize::from(told.abs() > 0.999 * limit);
        }
        checked += usize::from(check_efforts(&bench, id, &at, &before));
    }
    (limited, checked)
}

/// Checks that the reported efforts match inverse dynamics. Returns false if bodies touch or the tree is
/// fast, where no comparison is possible.
fn check_efforts(
    bench: &Bench,
    id: super::super::TreeId,
    at: &super::super::TreeState,
    before: &[f64],
) -> bool {
    // In a fast tree, spurious energy of the integration is removed (see `energy`), which is not part of a
    // drive's effort.
    let fast = |v: &[f64]| v.iter().any(|v| v.abs() > FAST_RAD / DT_S);
    if !bench.dynamics.solver.touches.is_empty() || fast(before) || fast(&bench.dynamics.tree(id).v) {
        return false;
    }
    let tree = bench.dynamics.tree(id);
    let acceleration: Vec<f64> =
        tree.v.iter().zip(before).map(|(after, before)| (after - before) / DT_S).collect();
    let mut old = Tree::new("chain", tree.links().to_vec()).unwrap();
    old.restore(at);
    let found = efforts(&old, before, &acceleration, DOWN);
    for link in 1..7 {
        let (found, told) = (found[5 + link], tree.drive_effort(link));
        assert!((found - told).abs() < 1e-7, "{found} {told} at link {link}");
    }
    true
}

/// A drive holds a load against gravity if its limit is just above the load, and yields if it is just below.
#[test]
fn dynamics_drive_gives_way_beyond_its_limit() {
    let mut mass = Mass::of_box(2.0, DVec3::splat(0.05));
    mass.com_m = DVec3::new(0.3, 0.0, 0.0);
    let weight_n_m = 2.0 * 9.81 * 0.3;
    let sag = |share: f64| {
        let mut axis = Axis::along(DVec3::Y);
        axis.effort_limit = weight_n_m * share;
        let mut bench = Bench::new(DOWN);
        let id = bench.add(jointed(Joint::Hinge(axis), mass));
        let drive = Drive { target: 0.0, kp: 500.0, kd: 20.0, feedforward: -weight_n_m };
        bench.dynamics.tree_mut(id).drive(0, drive);
        bench.run_s(1.0);
        bench.dynamics.tree(id).joint_position(0).abs()
    };
    assert!(sag(1.01) < 1e-6, "{}", sag(1.01));
    assert!(sag(0.97) > 0.1, "{}", sag(0.97));
}

/// Builds a flywheel of this inertia on a motor of 2 N m with a speed limit of 10 rad/s.
fn motor(inertia_kg_m2: f64) -> (Bench, super::super::TreeId) {
    let mut axis = Axis::along(DVec3::Z);
    (axis.effort_limit, axis.speed_limit, axis.armature) = (2.0, 10.0, inertia_kg_m2);
    let mut bench = Bench::new(DVec3::ZERO);
    let id = bench.add(jointed(Joint::Hinge(axis), Mass::NONE));
    (bench, id)
}

/// Returns the effort of a motor with this feedforward in a step that begins at this speed.
fn effort_at(speed: f64, push_n_m: f64) -> f64 {
    // The flywheel is so heavy that its speed is the same at the end of the step.
    let (mut bench, id) = motor(1e6);
    bench.dynamics.tree_mut(id).set_joint(0, 0.0, speed);
    bench.dynamics.tree_mut(id).drive(0, Drive { feedforward: push_n_m, ..Drive::NONE });
    bench.step();
    bench.dynamics.tree(id).drive_effort(0)
}

#[test]
fn dynamics_motor_at_its_speed_limit_pushes_nothing_and_beyond_it_brakes() {
    for (speed, push, brake) in [
        (0.0, 2.0, -2.0),
        (7.9, 2.0, -2.0),
        (9.0, 1.0, -2.0),
        (10.0, 0.0, -2.0),
        (11.0, -1.0, -2.0),
        (12.0, -2.0, -2.0),
        (30.0, -20.0, -20.0),
    ] {
        for sign in [1.0, -1.0] {
            let (pushed, braked) =
                (effort_at(sign * speed, sign * 5.0), effort_at(sign * speed, sign * -5.0));
            assert!((pushed - sign * push).abs() < 1e-6, "{pushed} at {speed}");
            assert!((braked - sign * brake).abs() < 1e-6, "{braked} at {speed}");
        }
    }
}

/// The limit holds for any inertia, with a feedforward effort and with a distant target.
#[test]
fn dynamics_motor_does_not_drive_itself_beyond_its_speed_limit() {
    let effort = Drive { feedforward: 50.0, ..Drive::NONE };
    let place = Drive { target: 1e3, kp: 50.0, kd: 0.5, feedforward: 0.0 };
    for drive in [effort, place] {
        for inertia_kg_m2 in [1e-6, 1e-3, 0.1] {
            let (mut bench, id) = motor(inertia_kg_m2);
            bench.dynamics.tree_mut(id).drive(0, drive);
            for _ in 0..400 {
                bench.step();
                let speed = bench.dynamics.tree(id).joint_velocity(0);
                assert!(speed < 10.0 + 1e-9, "{speed} of a wheel of {inertia_kg_m2} kg m^2");
            }
            let speed = bench.dynamics.tree(id).joint_velocity(0);
            assert!(speed > 9.0, "{speed} of a wheel of {inertia_kg_m2} kg m^2");
        }
    }
}

/// A flywheel turns at three times the speed of its motor, which keeps driving. It slows down to the
/// motor's speed and stays there, however light it is.
#[test]
fn dynamics_motor_brakes_what_turns_too_fast() {
    for inertia_kg_m2 in [1e-5, 1e-3, 0.02] {
        let (mut bench, id) = motor(inertia_kg_m2);
        bench.dynamics.tree_mut(id).set_joint(0, 0.0, 30.0);
        bench.dynamics.tree_mut(id).drive(0, Drive { feedforward: 50.0, ..Drive::NONE });
        let mut last = 30.0;
        for _ in 0..200 {
            bench.step();
            let speed = bench.dynamics.tree(id).joint_velocity(0);
            assert!(speed < last + 1e-9 && speed > 9.0, "{speed} after {last} of {inertia_kg_m2} kg m^2");
            last = speed;
        }
        assert!(last < 10.0 + 1e-3, "{last} of a wheel of {inertia_kg_m2} kg m^2");
    }
}

#[test]
fn dynamics_lone_trees_take_pushes() {
    let mut bench = Bench::new(DVec3::ZERO);
    let body = bench.add(super::bench::lone("crate", DPose3::IDENTITY, Mass::of_box(4.0, DVec3::splat(0.2))));
    bench.dynamics.tree_mut(body).push(0, DVec3::ZERO, DVec3::new(8.0, 0.0, 0.0));
    bench.dynamics.tree_mut(body).twist(0, DVec3::new(0.0, 0.0, 1.0));
    bench.step();
    bench.step();
    let tree = bench.dynamics.tree(body);
    let inertia = 4.0 * 0.04 * 2.0 / 3.0;
    assert!((tree.link_velocity_m_s(0) - DVec3::new(2.0 * DT_S, 0.0, 0.0)).length() < 1e-12);
    assert!((tree.link_spin_rad_s(0).z - DT_S / inertia).abs() < 1e-12);
}
