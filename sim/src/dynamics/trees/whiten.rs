//! Factoring a tree's mass matrix, and the way into whitened velocities and back; see [`super::factor`] for the algebra.

use super::tree::Tree;

impl Tree {
    /// M = L^T D L in place, from the leaves inwards.
    pub(in crate::dynamics) fn factorise(&mut self) {
        let (layout, factor) = (&self.layout, &mut self.factor);
        for k in (0..layout.dofs()).rev() {
            let range = layout.row(k);
            let (before, from) = factor.h.split_at_mut(range.start);
            let row = &mut from[..range.len()];
            let last = row.len() - 1;
            let d = row[last];
            factor.d[k] = d;
            factor.inverse_root_d[k] = 1.0 / d.sqrt();
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

    /// w = D^1/2 L v + D^-1/2 L^-T (dt rhs): the whitened velocity at the end of a step without constraints. Uses up `rhs`.
    pub(in crate::dynamics) fn whiten(&mut self, dt_s: f64, v: &[f64], w: &mut [f64]) {
        for k in (0..self.layout.dofs()).rev() {
            let row = &self.factor.h[self.layout.row(k)];
            let path = self.layout.path(k);
            let force = self.rhs[k];
            let mut lv = v[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                let j = usize::from(*j);
                self.rhs[j] -= l * force;
                lv += l * v[j];
            }
            let inverse_root_d = self.factor.inverse_root_d[k];
            w[k] = lv / inverse_root_d + force * dt_s * inverse_root_d;
        }
    }

    /// v = L^-1 D^-1/2 w.
    pub(in crate::dynamics) fn unwhiten(&self, w: &[f64], v: &mut [f64]) {
        for k in 0..self.layout.dofs() {
            let row = &self.factor.h[self.layout.row(k)];
            let path = self.layout.path(k);
            let mut lv = w[k] * self.factor.inverse_root_d[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                lv -= l * v[usize::from(*j)];
            }
            v[k] = lv;
        }
    }

    /// Y = D^-1/2 L^-T J^T in place, for N rows at once that are zero outside the path of degree of freedom `k`.
    #[inline]
    pub(in crate::dynamics) fn whiten_rows<const N: usize>(&self, k: usize, y: &mut [[f64; N]]) {
        let path = self.layout.path(k);
        for p in (0..path.len()).rev() {
            let i = usize::from(path[p]);
            let row = &self.factor.h[self.layout.row(i)];
            let (left, right) = y.split_at_mut(p);
            let pivot = right[0];
            for (t, l) in left.iter_mut().zip(row) {
                for c in 0..N {
                    t[c] -= l * pivot[c];
                }
            }
            for entry in &mut right[0] {
                *entry *= self.factor.inverse_root_d[i];
            }
        }
    }
}
