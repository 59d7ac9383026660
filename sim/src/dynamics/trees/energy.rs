//! Removal of spurious kinetic energy from fast trees.
//!
//! Coriolis forces are explicit in a step, and positions move along straight lines in joint coordinates.
//! Below 0.05 rad per step neither matters, but a fallen robot that thrashes about is faster. At such speeds
//! both together add kinetic energy, without bound as the speed grows. Real Coriolis forces do no work. With
//! the impulses P of everything else,
//!   M (v' - v) = P - dt h,   so that the work is
//!   P . (v + v') / 2 = K(q, v') - K(q, v) + dt h . (v + v') / 2,
//! and a step ought to end with
//!   K = K(q, v') + dt h . (v + v') / 2.
//! Likewise the linear momentum and the moment of momentum, H = sum I_i v_i about a fixed point, ought to be
//!   H = H(q, v') + dt sum f_i,   f_i the Coriolis and gyroscopic forces of the links.
//! A tree's motion is that of one rigid body with its H, plus that of its links against each other. The
//! two are orthogonal in M (Koenig), and their energies add up. The first is set so that H is as above;
//! the energy left over bounds the second. Slow trees are unchanged, bit for bit, and a lone body has
//! its own integrator (`free_spin`).

use rapier3d::glamx::DVec3;

use super::link::Joint;
use super::spatial::{ForceVector, Inertia, MotionVector, Symmetric};
use super::tree::Tree;

/// Speed of a joint or of the base, in rad per step, above which a tree counts as fast. Slower trees are
/// unchanged.
pub(in crate::dynamics) const FAST_RAD: f64 = 0.05;

/// Energy and momentum that a tree ought to have at the end of a step.
pub(in crate::dynamics) struct Due {
    energy_j: f64,
    /// Linear momentum, and angular momentum about `about_m`.
    momentum: ForceVector,
    about_m: DVec3,
}

impl Tree {
    /// Returns the energy and momentum that the tree ought to have at the end of the step. `v` are the
    /// velocities from the solver, `w` the same velocities whitened. The tree is in its state before the
    /// step. Returns `None` for a slow tree or a lone body.
    pub(in crate::dynamics) fn due(
        &mut self,
        gravity_m_s2: DVec3,
        dt_s: f64,
        v: &[f64],
        w: &[f64],
    ) -> Option<Due> {
        let fast = FAST_RAD / dt_s;
        let is_fast = |v: &[f64]| v.iter().skip(self.linear_dofs()).any(|v| v.abs() > fast);
        if self.is_lone() || !(is_fast(v) || is_fast(&self.v)) {
            return None;
        }
        self.gyroscopic_forces(gravity_m_s2);
        let mut momentum = self.force[0] * dt_s;
        let mut twice_j = 0.0;
        for (i, link) in self.links.iter().enumerate() {
            let dof = self.layout.first_dof[i];
            for k in dof..dof + link.joint.dofs() {
                let coriolis = self.axis[k].dot(self.force[i]);
                twice_j +=
                    w[k] * w[k] - self.implicit[k] * v[k] * v[k] + dt_s * coriolis * (self.v[k] + v[k]);
                // Composite inertia of this link and all links beyond it.
                momentum += self.inertia[i].mul(self.axis[k] * v[k]);
            }
        }
        Some(Due { energy_j: 0.5 * twice_j, momentum, about_m: self.reference_m })
    }

    /// Computes the force on each link, all links beyond it included, for its present motion without joint
    /// acceleration.
    fn gyroscopic_forces(&mut self, gravity_m_s2: DVec3) {
        let lifted = MotionVector { angular: DVec3::ZERO, linear: -gravity_m_s2 };
        for i in 0..self.links.len() {
            let (inertia, velocity) = (self.inertia_of(i), self.velocity[i]);
            self.force[i] =
                inertia.mul(self.acceleration[i] - lifted) + velocity.cross_force(inertia.mul(velocity));
        }
        for i in (1..self.links.len()).rev() {
            if let Some(parent) = self.links[i].parent {
                let beyond = self.force[i];
                self.force[parent] += beyond;
            }
        }
    }

    /// Returns the number of translational degrees of freedom of the base.
    fn linear_dofs(&self) -> usize {
        if matches!(self.links[0].joint, Joint::Free) { 3 } else { 0 }
    }

    /// Sets the momentum of a moved tree to that in `due`, and removes the energy above that in `due`.
    pub(in crate::dynamics) fn settle(&mut self, due: &Due) {
        let (whole, momentum, has_j) = self.motion();
        let (mut rigid, mut wanted) = (MotionVector::default(), MotionVector::default());
        if let Joint::Free = self.links[0].joint {
            let ForceVector { angular, linear } = due.momentum;
            let angular = angular - (self.reference_m - due.about_m).cross(linear);
            rigid = rigid_motion(&whole, momentum);
            wanted = rigid_motion(&whole, ForceVector { angular, linear });
        }
        let energy_j = |motion: MotionVector| 0.5 * motion.dot(whole.mul(motion));
        let (within_j, left_j) = (has_j - energy_j(rigid), due.energy_j - energy_j(wanted));
        let share =
            if within_j > left_j && within_j > 0.0 { (left_j / within_j).max(0.0).sqrt() } else { 1.0 };
        let base = 2 * self.linear_dofs();
        if base > 0 {
            let [linear, angular] = [0, 3].map(|first| DVec3::from_slice(&self.v[first..first + 3]));
            (wanted.linear + (linear - rigid.linear) * share).write_to_slice(&mut self.v[..3]);
            (wanted.angular + (angular - rigid.angular) * share).write_to_slice(&mut self.v[3..6]);
        }
        self.v[base..].iter_mut().for_each(|v| *v *= share);
        self.velocities();
    }

    /// Returns the inertia and momentum of the whole tree, and its kinetic energy, drives included.
    fn motion(&self) -> (Inertia, ForceVector, f64) {
        let mut whole = Inertia::default();
        let mut momentum = ForceVector::default();
        let mut twice_j = 0.0;
        for (i, link) in self.links.iter().enumerate() {
            let inertia = self.inertia_of(i);
            let own = inertia.mul(self.velocity[i]);
            twice_j += self.velocity[i].dot(own);
            momentum += own;
            whole += inertia;
            if let Some(axis) = link.joint.axis() {
                let v = self.v[self.layout.first_dof[i]];
                twice_j += axis.armature * v * v;
            }
        }
        (whole, momentum, 0.5 * twice_j)
    }
}

/// Returns the motion about the reference of a rigid body with this inertia and momentum.
fn rigid_motion(whole: &Inertia, momentum: ForceVector) -> MotionVector {
    let com_m = whole.first_kg_m / whole.mass_kg;
    let velocity_m_s = momentum.linear / whole.mass_kg;
    let mut about_com = whole.second_kg_m2;
    about_com += Symmetric::of_point(-whole.mass_kg, com_m);
    let angular = about_com.matrix().inverse() * (momentum.angular - com_m.cross(momentum.linear));
    MotionVector { angular, linear: velocity_m_s - angular.cross(com_m) }
}
