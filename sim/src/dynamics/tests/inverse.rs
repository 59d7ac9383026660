//! Forward dynamics against an independent inverse dynamics, which uses accelerations of points instead of
//! spatial vectors.

use rapier3d::glamx::{DMat3, DVec3};

use super::super::{Drive, Joint, Tree};
use super::bench::{Bench, DOWN, DT_S, Random, bush, hinge, stir};

/// Computes the efforts for an acceleration `a`, by degree of freedom, with Newton-Euler link by link:
///   c'' = o'' + dw x r + w x (w x r),  f = m (c'' - g),  n = I dw + w x I w.
/// For a free first link, the efforts are the force on it and the moment about its centre of mass.
pub fn efforts(tree: &Tree, v: &[f64], a: &[f64], gravity_m_s2: DVec3) -> Vec<f64> {
    let mut motion: Vec<(DVec3, DVec3, DVec3)> = Vec::new();
    let mut loads: Vec<(DVec3, DVec3)> = Vec::new();
    let mut dof = 0;
    for (index, link) in tree.links().iter().enumerate() {
        let pose = tree.world_from_link(index);
        let (mut spin, mut turn, mut origin) = (DVec3::ZERO, DVec3::ZERO, DVec3::ZERO);
        if let Some(parent) = link.parent {
            let (w, dw, o) = motion[parent];
            let arm = pose.translation - tree.world_from_link(parent).translation;
            (spin, turn, origin) = (w, dw, o + dw.cross(arm) + w.cross(w.cross(arm)));
        }
        let (before, arm_com) = (spin, pose.rotation * link.mass.com_m);
        match &link.joint {
            Joint::Fixed => {}
            Joint::Free => {
                spin = DVec3::from_slice(&v[3..6]);
                turn = DVec3::from_slice(&a[3..6]);
                origin = DVec3::from_slice(&a[..3]) - turn.cross(arm_com) - spin.cross(spin.cross(arm_com));
            }
            Joint::Hinge(axis) => {
                // The origin turns about the anchor: subtract the parent's arm to the origin, then add
                // the arm from the anchor.
                let along = pose.rotation * axis.direction;
                let arm = -(pose.rotation * axis.anchor_m);
                let anchor = origin - turn.cross(arm) - spin.cross(spin.cross(arm));
                turn += along * a[dof] + before.cross(along * v[dof]);
                spin += along * v[dof];
                origin = anchor + turn.cross(arm) + spin.cross(spin.cross(arm));
            }
            Joint::Slide(axis) => {
                let along = pose.rotation * axis.direction;
                origin += along * a[dof] + 2.0 * spin.cross(along * v[dof]);
            }
        }
        dof += dofs(&link.joint);
        let rotation = DMat3::from_quat(pose.rotation);
        let inertia = rotation * link.mass.inertia_kg_m2 * rotation.transpose();
        let centre = origin + turn.cross(arm_com) + spin.cross(spin.cross(arm_com));
        let force = (centre - gravity_m_s2) * link.mass.mass_kg;
        let moment = inertia * turn + spin.cross(inertia * spin) + (pose * link.mass.com_m).cross(force);
        motion.push((spin, turn, origin));
        loads.push((force, moment));
    }
    gathered(tree, a, loads, dof)
}

/// Sums the loads of the links, as force and moment about the world's origin, inwards along the tree.
fn gathered(tree: &Tree, a: &[f64], mut loads: Vec<(DVec3, DVec3)>, mut dof: usize) -> Vec<f64> {
    let mut efforts = vec![0.0; dof];
    for index in (0..loads.len()).rev() {
        let link = &tree.links()[index];
        let (force, moment): (DVec3, DVec3) = loads[index];
        let pose = tree.world_from_link(index);
        dof -= dofs(&link.joint);
        match &link.joint {
            Joint::Fixed => {}
            Joint::Free => {
                force.write_to_slice(&mut efforts[..3]);
                (moment - (pose * link.mass.com_m).cross(force)).write_to_slice(&mut efforts[3..6]);
            }
            Joint::Hinge(axis) => {
                let about = moment - (pose * axis.anchor_m).cross(force);
                efforts[dof] = (pose.rotation * axis.direction).dot(about) + axis.armature * a[dof];
            }
            Joint::Slide(axis) => {
                efforts[dof] = (pose.rotation * axis.direction).dot(force) + axis.armature * a[dof];
            }
        }
        if let Some(parent) = link.parent {
            loads[parent].0 += force;
            loads[parent].1 += moment;
        }
    }
    efforts
}

fn dofs(joint: &Joint) -> usize {
    match joint {
        Joint::Free => 6,
        Joint::Fixed => 0,
        Joint::Hinge(_) | Joint::Slide(_) => 1,
    }
}

fn check(root: Joint, seed: u64) {
    let mut random = Random(seed);
    let mut tree = bush(root, &mut random);
    // The motion is slow and gently driven, because spurious energy of the integration is removed from a fast
    // tree (see `energy`).
    stir(&mut tree, &mut random, 2.0);
    let mut wanted = vec![0.0; tree.dofs()];
    for link in 0..tree.links().len() {
        let feedforward = 2.0 * random.number();
        tree.drive(link, Drive { feedforward, ..Drive::NONE });
        if tree.links()[link].joint.axis().is_some() {
            wanted[tree.layout.first_dof[link]] = feedforward;
        }
    }
    let (at, before) = (tree.state(), tree.v.clone());
    let mut bench = Bench::new(DOWN);
    let id = bench.add(tree);
    bench.step();
    let after = bench.dynamics.tree(id).v.clone();
    let acceleration: Vec<f64> =
        after.iter().zip(&before).map(|(after, before)| (after - before) / DT_S).collect();
    bench.dynamics.tree_mut(id).restore(&at);
    let found = efforts(bench.dynamics.tree(id), &before, &acceleration, DOWN);
    for (dof, (found, wanted)) in found.iter().zip(&wanted).enumerate() {
        assert!((found - wanted).abs() < 1e-9 * (1.0 + wanted.abs()), "dof {dof}: {found} for {wanted}");
    }
}

#[test]
fn dynamics_forward_and_inverse_agree() {
    for seed in 0..20 {
        check(Joint::Free, seed);
        check(Joint::Fixed, seed);
        check(hinge(DVec3::new(0.3, -0.5, 0.8)), seed);
    }
}
