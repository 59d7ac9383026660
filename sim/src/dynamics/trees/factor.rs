//! The factor of a mass matrix, M = L^T D L along the tree, and the whitened velocities w = D^1/2 L v.
//!
//! Rows of constraints are whitened as Y = D^-1/2 L^-T J^T. Then the kinetic energy is |w|^2 / 2, an
//! impulse lambda changes w by Y lambda, and the effective inverse mass of a row is Y . Y. Neither M^-1 J^T
//! nor J M^-1 J^T is formed. L has the sparsity of the tree: each column is non-zero only on the path to
//! the world. Source: Featherstone 2008, section 6.5 and table 6.3.

use pulp::Simd;

use super::layout::Layout;

pub struct Factor {
    /// Packed rows: M, then after [`Factor::factorise`] L. The diagonal of L is 1 and not stored.
    pub h: Vec<f64>,
    d: Vec<f64>,
    pub inverse_root_d: Vec<f64>,
}

/// Minimum pivot that is inertia rather than rounding error: 1 g at 0.1 mm has 1e-11 kg m^2.
const SMALLEST_INERTIA: f64 = 1e-14;

impl Factor {
    pub fn sized(layout: &Layout) -> Factor {
        let dofs = layout.dofs();
        Factor { h: vec![0.0; layout.packed()], d: vec![0.0; dofs], inverse_root_d: vec![0.0; dofs] }
    }

    pub fn is_positive(&self, dof: usize) -> bool {
        self.d[dof] > SMALLEST_INERTIA
    }

    /// Computes M = L^T D L in place, from the leaves inwards.
    pub fn factorise(&mut self, layout: &Layout) {
        for k in (0..layout.dofs()).rev() {
            let range = layout.row(k);
            let (before, from) = self.h.split_at_mut(range.start);
            let row = &mut from[..range.len()];
            let last = row.len() - 1;
            let d = row[last];
            self.d[k] = d;
            self.inverse_root_d[k] = 1.0 / d.sqrt();
            let path = layout.path(k);
            for p in (0..last).rev() {
                let share = row[p] / d;
                let target = layout.row(usize::from(path[p]));
                for (t, x) in before[target].iter_mut().zip(&row[..=p]) {
                    *t -= share * x;
                }
                row[p] = share;
            }
        }
    }

    /// Computes w = D^1/2 L v + D^-1/2 L^-T (dt rhs), the unconstrained whitened velocity; overwrites `rhs`.
    pub fn whiten(&self, layout: &Layout, dt_s: f64, v: &[f64], rhs: &mut [f64], w: &mut [f64]) {
        for k in (0..layout.dofs()).rev() {
            let row = &self.h[layout.row(k)];
            let path = layout.path(k);
            let force = rhs[k];
            let mut lv = v[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                let j = usize::from(*j);
                rhs[j] -= l * force;
                lv += l * v[j];
            }
            let inverse_root_d = self.inverse_root_d[k];
            w[k] = lv / inverse_root_d + force * dt_s * inverse_root_d;
        }
    }

    /// Computes w = D^1/2 L v.
    pub fn whiten_velocity(&self, layout: &Layout, v: &[f64], w: &mut [f64]) {
        for k in 0..layout.dofs() {
            let path = layout.path(k);
            let beyond = self.h[layout.row(k)].iter().zip(&path[..path.len() - 1]);
            let lv = v[k] + beyond.map(|(l, j)| l * v[usize::from(*j)]).sum::<f64>();
            w[k] = lv / self.inverse_root_d[k];
        }
    }

    /// Computes v = L^-1 D^-1/2 w.
    pub fn unwhiten(&self, layout: &Layout, w: &[f64], v: &mut [f64]) {
        for k in 0..layout.dofs() {
            let row = &self.h[layout.row(k)];
            let path = layout.path(k);
            let mut lv = w[k] * self.inverse_root_d[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                lv -= l * v[usize::from(*j)];
            }
            v[k] = lv;
        }
    }

    /// Computes Y = D^-1/2 L^-T J^T in place, for N rows that are zero off the path of degree of freedom `k`.
    #[inline(always)]
    pub fn whiten_rows<S: Simd, const N: usize>(
        &self,
        simd: S,
        layout: &Layout,
        k: usize,
        y: &mut [[f64; N]],
    ) {
        let path = layout.path(k);
        for p in (0..path.len()).rev() {
            let i = usize::from(path[p]);
            let row = &self.h[layout.row(i)];
            let (left, right) = y.split_at_mut(p);
            let pivot = right[0];
            for (t, l) in left.iter_mut().zip(row) {
                subtract(simd, t, *l, &pivot);
            }
            for entry in &mut right[0] {
                *entry *= self.inverse_root_d[i];
            }
        }
    }
}

/// Computes t -= l pivot, element by element.
#[inline(always)]
fn subtract<S: Simd>(simd: S, t: &mut [f64], l: f64, pivot: &[f64]) {
    let ((wide_t, t), (wide_pivot, pivot)) = (S::as_mut_simd_f64s(t), S::as_simd_f64s(pivot));
    let wide_l = simd.splat_f64s(l);
    for (t, pivot) in wide_t.iter_mut().zip(wide_pivot) {
        *t = simd.sub_f64s(*t, simd.mul_f64s(wide_l, *pivot));
    }
    for (t, pivot) in t.iter_mut().zip(pivot) {
        *t -= l * pivot;
    }
}
