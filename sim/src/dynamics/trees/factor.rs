//! M = L^T D L along the tree, and the whitened velocities w = D^1/2 L v.
//!
//! Rows of constraints are whitened as Y = D^-1/2 L^-T J^T: then the kinetic energy is |w|^2 / 2, an impulse lambda
//! changes w by Y lambda, and the effective inverse mass of a row is Y . Y. Neither M^-1 J^T nor J M^-1 J^T is formed.
//! L has the sparsity of the tree: column by column, only the path to the world.
//! Source: Featherstone 2008, section 6.5 and table 6.3.

use super::layout::Layout;

pub struct Factor {
    /// Packed rows: M, after [`Tree::factorise`] L, whose diagonal is 1 and not stored.
    pub h: Vec<f64>,
    pub d: Vec<f64>,
    pub inverse_root_d: Vec<f64>,
}

/// Anything below is rounding, not inertia: a gram at a tenth of a millimetre has 1e-11 kg m^2.
const SMALLEST_INERTIA: f64 = 1e-14;

impl Factor {
    pub fn sized(layout: &Layout) -> Factor {
        let dofs = layout.dofs();
        Factor { h: vec![0.0; layout.packed()], d: vec![0.0; dofs], inverse_root_d: vec![0.0; dofs] }
    }

    pub fn is_positive(&self, dof: usize) -> bool {
        self.d[dof] > SMALLEST_INERTIA
    }
}
