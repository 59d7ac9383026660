//! The equations of motion of a tree, M v' + bias = tau: the bias forces and the mass matrix M.
//!
//! Bias forces are those that the joints must exert so that nothing accelerates, from Newton and Euler.
//! Outwards:
//!   a_i = a_p + v_p x S q',  f_i = I_i a_i + v_i x* I_i v_i,  with a_0 = -g;
//! inwards:  bias_k = S_k . f,  f_p += f_i. Source: Featherstone 2008, section 5.3, in world axes about
//! the tree's reference.
//!
//! The mass matrix is computed by composite rigid bodies. With I_c the inertia of a link and everything
//! beyond it:
//!   M_jk = S_j . I_c(k) S_k for j on the path to k.
//! Source: Featherstone 2008, section 6.2.

use rapier3d::glamx::DVec3;

use super::link::Joint;
use super::spatial::{ForceVector, Inertia, MotionVector, Symmetric};
use super::tree::Tree;

impl Tree {
    /// Sets `rhs` to -bias plus the external forces, and computes the spatial inertia of each link.
    #[inline(always)]
    pub(in crate::dynamics) fn bias(&mut self, gravity_m_s2: DVec3) {
        let count = self.links.len();
        for i in 0..count {
            let acceleration = self.velocity_product(i, gravity_m_s2);
            let inertia = self.inertia_of(i);
            self.inertia[i] = inertia;
            self.acceleration[i] = acceleration;
            let velocity = self.velocity[i];
            self.force[i] =
                inertia.mul(acceleration) + velocity.cross_force(inertia.mul(velocity)) - self.external[i];
        }
        for i in (0..count).rev() {
            let force: ForceVector = self.force[i];
            let dof = self.layout.first_dof[i];
            for k in dof..dof + self.links[i].joint.dofs() {
                self.rhs[k] = -self.axis[k].dot(force);
            }
            if let Some(parent) = self.links[i].parent {
                self.force[parent] += force;
            }
        }
    }

    /// Returns the spatial inertia of one link.
    #[inline(always)]
    pub(in crate::dynamics) fn inertia_of(&self, i: usize) -> Inertia {
        let (mass_kg, com_m) = (self.links[i].mass.mass_kg, self.centre_m(i));
        let mut second_kg_m2 = self.own_inertia[i].rotated(&self.rotation[i]);
        second_kg_m2 += Symmetric::of_point(mass_kg, com_m);
        Inertia { mass_kg, first_kg_m: com_m * mass_kg, second_kg_m2 }
    }

    /// Returns a_p + v_p x S q', the acceleration with q'' = 0. Gravity is an upward acceleration of the
    /// world.
    #[inline(always)]
    fn velocity_product(&self, i: usize, gravity_m_s2: DVec3) -> MotionVector {
        let lifted = MotionVector { angular: DVec3::ZERO, linear: -gravity_m_s2 };
        let velocity = self.velocity[i];
        match self.links[i].parent {
            Some(parent) => {
                let before = self.velocity[parent];
                self.acceleration[parent] + before.cross(velocity - before)
            }
            // The velocity of a free joint is that of a moving point; the spatial velocity is that at a
            // fixed point.
            None if matches!(self.links[i].joint, Joint::Free) => {
                lifted
                    - MotionVector { angular: DVec3::ZERO, linear: velocity.angular.cross(velocity.linear) }
            }
            None => lifted,
        }
    }

    /// Fills the packed rows from the links' own inertias (see [`Tree::bias`]), armatures and implicit terms.
    #[inline(always)]
    pub(in crate::dynamics) fn composite_mass_matrix(&mut self) {
        for i in (0..self.links.len()).rev() {
            let composite = self.inertia[i];
            let link = &self.links[i];
            let dof = self.layout.first_dof[i];
            for k in dof..dof + link.joint.dofs() {
                let force = composite.mul(self.axis[k]);
                let path = self.layout.path(k);
                let row = &mut self.factor.h[self.layout.row(k)];
                for (entry, j) in row.iter_mut().zip(path) {
                    *entry = self.axis[usize::from(*j)].dot(force);
                }
                let armature = link.joint.axis().map_or(0.0, |axis| axis.armature);
                if let Some(diagonal) = row.last_mut() {
                    *diagonal += armature + self.implicit[k];
                }
            }
            if let Some(parent) = link.parent {
                self.inertia[parent] += composite;
            }
        }
    }
}
