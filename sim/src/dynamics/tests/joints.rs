//! Joints of one degree of freedom, limits and equalities.

use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};
use rapier3d::math::Vector;
use rapier3d::prelude::SharedShape;

use super::super::{Axis, Drive, Equality, Joint, Link, Mass, Tree};
use super::bench::{Bench, DOWN, DT_S, G_M_S2, hinge, jointed, link, lone, sliding};

/// A pendulum at 0.2 rad has the exact period, and keeps its energy over 20 s.
#[test]
fn dynamics_pendulum() {
    let (mass_kg, length_m) = (1.3, 0.7);
    let mut mass = Mass::of_box(mass_kg, DVec3::new(0.05, 0.05, 0.1));
    mass.com_m = DVec3::new(0.0, 0.0, -length_m);
    let inertia = mass.inertia_kg_m2.y_axis.y + mass_kg * length_m * length_m;
    let mut bench = Bench::new(DOWN);
    let id = bench.add(jointed(hinge(DVec3::Y), mass));
    bench.dynamics.tree_mut(id).set_joint(0, 0.2, 0.0);
    let energy_j = bench.energy_j(id);
    let swing_j = mass_kg * G_M_S2 * length_m * (1.0 - 0.2f64.cos());
    let (mut crossings, mut last) = (Vec::new(), 0.2);
    for step in 1..=4000 {
        bench.step();
        let q = bench.dynamics.tree(id).joint_position(0);
        if last > 0.0 && q <= 0.0 {
            crossings.push((step as f64 - q / (q - last)) * DT_S);
        }
        last = q;
        assert!((bench.energy_j(id) - energy_j).abs() < 0.02 * swing_j, "energy at step {step}");
    }
    let period_s = (crossings[crossings.len() - 1] - crossings[0]) / (crossings.len() - 1) as f64;
    let small = std::f64::consts::TAU * (inertia / (mass_kg * G_M_S2 * length_m)).sqrt();
    let wanted_s = small * (1.0 + 0.2f64.powi(2) / 16.0);
    assert!((period_s / wanted_s - 1.0).abs() < 2e-4, "{period_s} for {wanted_s}");
}

/// I q'' + c q' + k q = 0, underdamped. Implicit springs add  omega dt / 2  to the damping ratio.
#[test]
fn dynamics_hinge_with_spring_and_damper() {
    let mass = Mass::of_box(3.0, DVec3::new(0.1, 0.1, 0.1));
    let inertia = mass.inertia_kg_m2.z_axis.z;
    let (omega, ratio) = (4.0, 0.2);
    let mut axis = Axis::along(DVec3::Z);
    axis.stiffness = inertia * omega * omega;
    axis.damping = 2.0 * ratio * omega * inertia;
    axis.spring_rest = 0.3;
    let mut bench = Bench::new(DVec3::ZERO);
    let id = bench.add(jointed(Joint::Hinge(axis), mass));
    bench.dynamics.tree_mut(id).set_joint(0, 0.8, 0.0);
    let numeric = ratio + 0.5 * omega * DT_S;
    let damped = omega * (1.0 - numeric * numeric).sqrt();
    for step in 1..=600 {
        bench.step();
        let t = f64::from(step) * DT_S;
        let decay = (-numeric * omega * t).exp();
        let wanted = 0.3 + 0.5 * decay * ((damped * t).cos() + numeric * omega / damped * (damped * t).sin());
        let q = bench.dynamics.tree(id).joint_position(0);
        assert!((q - wanted).abs() < 0.005, "{q} for {wanted} after {t} s");
    }
}

#[test]
fn dynamics_slide_under_a_force_and_with_dry_friction() {
    let mut axis = Axis::along(DVec3::X);
    axis.armature = 0.5;
    axis.friction_loss = 1.0;
    let mut bench = Bench::new(DOWN);
    let id = bench.add(jointed(Joint::Slide(axis), Mass::of_box(1.5, DVec3::splat(0.1))));
    let push = |bench: &mut Bench, feedforward| {
        bench.dynamics.tree_mut(id).drive(0, Drive { feedforward, ..Drive::NONE });
        bench.run_s(1.0);
        bench.dynamics.tree(id).joint_position(0)
    };
    assert!(push(&mut bench, 0.999).abs() < 1e-12, "held by dry friction");
    let slid_m = push(&mut bench, 3.0);
    assert!((slid_m - 0.5 * (1.0 + DT_S)).abs() < 1e-9, "{slid_m}");
}

/// An arm and a light finger stop at the end of the range after being driven into it at full speed.
#[test]
fn dynamics_joint_stops_at_its_limit() {
    for (half_m, effort) in [(DVec3::new(0.2, 0.03, 0.03), 60.0), (DVec3::new(0.02, 0.008, 0.008), 1.5)] {
        let mut mass = Mass::of_box(half_m.x * 5.0, half_m);
        mass.com_m = DVec3::new(half_m.x, 0.0, 0.0);
        let mut axis = Axis::along(DVec3::Z);
        axis.range = Some([-1.0, 1.0]);
        axis.effort_limit = effort;
        let mut bench = Bench::new(DOWN);
        let id = bench.add(jointed(Joint::Hinge(axis), mass));
        let tree = bench.dynamics.tree_mut(id);
        tree.set_joint(0, 0.0, 30.0);
        tree.drive(0, Drive { target: 5.0, kp: 200.0, kd: 0.5, feedforward: 0.0 });
        for _ in 0..200 {
            bench.step();
            let q = bench.dynamics.tree(id).joint_position(0);
            assert!(q < 1.001, "{q}");
        }
        assert!(bench.dynamics.tree(id).joint_position(0) > 0.999);
    }
}

#[test]
fn dynamics_coupled_joints_follow() {
    let polynomial = [0.1, 0.8, -0.3, 0.2, 0.0];
    let mut mass = Mass::of_box(0.2, DVec3::new(0.05, 0.01, 0.01));
    mass.com_m = DVec3::new(0.05, 0.0, 0.0);
    let joint = || hinge(DVec3::Y);
    let links =
        vec![link(None, DVec3::ZERO, joint(), mass), link(Some(0), DVec3::new(0.1, 0.0, 0.0), joint(), mass)];
    let mut bench = Bench::new(DOWN);
    let id = bench.add(Tree::new("finger", links).unwrap());
    let (follower, leader) = (id.link(1), Some(id.link(0)));
    bench.dynamics.add_equality(Equality::Couple { follower, leader, polynomial }, true);
    bench.dynamics.tree_mut(id).set_joint(1, 0.1, 0.0);
    for step in 0..600 {
        let target = 1.2 * (f64::from(step) * DT_S * 3.0).sin();
        bench.dynamics.tree_mut(id).drive(0, Drive { target, kp: 20.0, kd: 0.5, feedforward: 0.0 });
        bench.step();
        let tree = bench.dynamics.tree(id);
        let (x, y) = (tree.joint_position(0), tree.joint_position(1));
        let wanted = polynomial.iter().rev().fold(0.0, |sum, a| sum * x + a);
        assert!((y - wanted).abs() < 2e-3, "{y} for {wanted} at step {step}");
    }
}

/// A welded body hangs without moving; with the weld off, it falls. A connected point stays in place.
#[test]
fn dynamics_weld_and_connect() {
    let half_m = DVec3::new(0.1, 0.05, 0.02);
    let at = DPose3::from_translation(DVec3::new(0.5, 0.0, 1.0));
    let mut bench = Bench::new(DOWN);
    let arm = bench.add(jointed(Joint::Fixed, Mass::of_box(1.0, half_m)));
    let body = bench.add(lone("picture", at, Mass::of_box(2.0, half_m)));
    let weld = Equality::Weld { a: arm.link(0), a_from_b: at, b: Some(body.link(0)) };
    let weld = bench.dynamics.add_equality(weld, true);
    bench.run_s(2.0);
    let moved_m = (bench.position_m(body) - at.translation).length();
    assert!(moved_m < 1e-3, "{moved_m}");
    bench.dynamics.set_active(weld, false);
    let corner_m = DVec3::new(0.1, 0.05, 0.0);
    let pin = Equality::Connect {
        a: body.link(0),
        a_point_m: corner_m,
        b: None,
        b_point_m: at.translation + corner_m,
    };
    let pin = bench.dynamics.add_equality(pin, true);
    for _ in 0..400 {
        bench.step();
        let off = bench.dynamics.tree(body).world_from_link(0) * corner_m - at.translation - corner_m;
        assert!(off.length() < 3e-3, "{off}");
    }
    assert!((bench.position_m(body) - at.translation).length() > 0.05, "it swings");
    bench.dynamics.set_active(pin, false);
    let before_m = bench.position_m(body).z;
    bench.run_s(0.5);
    assert!(bench.position_m(body).z < before_m - 0.5);
}

/// A top on a pin at steady precession W keeps its tilt. With I1 about the pin,
/// I1 W^2 cos(tilt) - I3 w3 W + m g h = 0.
#[test]
fn dynamics_top_precesses() {
    let (mass_kg, height_m, tilt_rad, precession_rad_s) = (1.0, 0.04, 0.3_f64, 1.6);
    let (across, along) = (0.005, 0.01);
    let mass = Mass {
        mass_kg,
        com_m: DVec3::new(0.0, 0.0, height_m),
        inertia_kg_m2: DMat3::from_diagonal(DVec3::new(across, across, along)),
    };
    let about_pin = across + mass_kg * height_m * height_m;
    let moment_n_m = mass_kg * G_M_S2 * height_m;
    let own_rad_s = (about_pin * precession_rad_s * precession_rad_s * tilt_rad.cos() + moment_n_m)
        / (along * precession_rad_s);
    let at = DPose3::from_parts(DVec3::ZERO, DQuat::from_rotation_x(tilt_rad));
    let axis = at.rotation * DVec3::Z;
    let turning = DVec3::Z * precession_rad_s;
    let spin_rad_s = turning + axis * (own_rad_s - turning.dot(axis));
    let mut bench = Bench::new(DOWN);
    let top = bench.add(lone("top", at, mass));
    bench.dynamics.tree_mut(top).set_base(at, DVec3::ZERO, spin_rad_s);
    let pin = Equality::Connect { a: top.link(0), a_point_m: DVec3::ZERO, b: None, b_point_m: DVec3::ZERO };
    bench.dynamics.add_equality(pin, true);
    for step in 1..=800 {
        bench.step();
        let turned = DQuat::from_rotation_z(precession_rad_s * f64::from(step) * DT_S);
        let is = bench.dynamics.tree(top).world_from_link(0).rotation * DVec3::Z;
        assert!((is - turned * axis).length() < 0.02, "{is} for {} at step {step}", turned * axis);
    }
}

/// A coupling that holds a hinge: the latch of a door under a pull.
#[test]
fn dynamics_latch_holds_a_door() {
    let half_m = DVec3::new(0.4, 0.02, 1.0);
    let mut mass = Mass::of_box(20.0, half_m);
    mass.com_m = DVec3::new(0.4, 0.0, 0.0);
    let mut bench = Bench::new(DOWN);
    let door = bench.add(jointed(hinge(DVec3::Z), mass));
    let latch = Equality::Couple { follower: door.link(0), leader: None, polynomial: [0.0; 5] };
    let latch = bench.dynamics.add_equality(latch, true);
    let pull = |bench: &mut Bench| {
        for _ in 0..200 {
            let tree = bench.dynamics.tree_mut(door);
            tree.push(0, DVec3::new(0.8, 0.0, 0.0), DVec3::new(0.0, 30.0, 0.0));
            bench.step();
        }
        bench.dynamics.tree(door).joint_position(0)
    };
    let held = pull(&mut bench);
    assert!(held.abs() < 1e-3, "{held}");
    bench.dynamics.set_active(latch, false);
    let open = pull(&mut bench);
    assert!(open > 0.5, "{open}");
}

#[test]
fn dynamics_trees_that_cannot_be_are_named() {
    let massless = Tree::new("arm", vec![link(None, DVec3::ZERO, hinge(DVec3::Z), Mass::NONE)]);
    assert!(massless.err().unwrap().to_string().contains("armature"));
    let mass = Mass::of_box(1.0, DVec3::ONE);
    let two: Vec<Link> =
        vec![link(None, DVec3::ZERO, Joint::Fixed, mass), link(Some(0), DVec3::ZERO, Joint::Free, mass)];
    assert!(Tree::new("pair", two).err().unwrap().to_string().contains("only the first link"));
}

/// A heavy ball strikes a finger that is far from the end of its range. The finger stops at that end, and the
/// ball stops on the finger.
#[test]
fn dynamics_blow_does_not_drive_a_light_link_beyond_its_range() {
    for speed_m_s in [1.0, 3.0, 6.0] {
        let mut axis = Axis::along(DVec3::Y);
        (axis.range, axis.armature) = (Some([-1.5, 0.3]), 0.0005);
        let mut mass = Mass::of_box(0.02, DVec3::new(0.02, 0.01, 0.01));
        mass.com_m = DVec3::new(0.025, 0.0, 0.0);
        let mut bench = Bench::new(DVec3::ZERO);
        let finger = bench.add(jointed(Joint::Hinge(axis), mass));
        let (knuckle, tip) = (Vector::ZERO, Vector::new(0.045, 0.0, 0.0));
        bench.add_shape(finger.link(0), SharedShape::capsule(knuckle, tip, 0.01), sliding(0.5));
        let at_m = DVec3::new(0.035, 0.0, 0.0615);
        let ball = bench.add_ball(5.0, 0.05, at_m, sliding(0.5));
        let at = DPose3::from_translation(at_m);
        bench.dynamics.tree_mut(ball).set_base(at, DVec3::new(0.0, 0.0, -speed_m_s), DVec3::ZERO);
        let (mut farthest_rad, mut deepest_m) = (0.0f64, 0.0f64);
        for _ in 0..60 {
            bench.step();
            farthest_rad = farthest_rad.max(bench.dynamics.tree(finger).joint_position(0));
            deepest_m =
                bench.dynamics.solver.touches.iter().fold(deepest_m, |most, touch| most.max(-touch.gap_m));
        }
        assert!(farthest_rad > 0.25, "it was struck: {farthest_rad} rad");
        assert!(
            farthest_rad < 0.35 && deepest_m < 0.02,
            "{farthest_rad} rad, {deepest_m} m at {speed_m_s} m/s"
        );
    }
}
