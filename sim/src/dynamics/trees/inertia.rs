//! The mass matrix by composite rigid bodies.
//!
//! With I_c the inertia of a link and everything beyond it:  M_jk = S_j . I_c(k) S_k for j on the path to k.
//! Source: Featherstone 2008, section 6.2.

use super::tree::Tree;

impl Tree {
    /// Fills the packed rows from the links' own inertias (see [`Tree::bias`]), armatures and implicit terms.
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
