//! Trees of one layout, whose mass matrices are factorised and whose velocities are whitened side by side.

use std::array::from_fn;

use super::{ABREAST, Abreast};
use crate::dynamics::trees::Trees;
use crate::dynamics::trees::layout::Layout;
use crate::dynamics::trees::tree::Tree;

/// Trees of one layout, at most one per lane.
pub struct Alike {
    /// Indices of these trees among all trees.
    pub trees: Vec<usize>,
    /// The factors as in `factor`: L, whose packed rows are first those of M, and D^-1/2.
    l: Vec<Abreast>,
    inverse_root_d: Vec<Abreast>,
    /// Velocities and right-hand sides during whitening.
    v: Vec<Abreast>,
    rhs: Vec<Abreast>,
}

impl Alike {
    pub fn begin(tree: usize) -> Alike {
        Alike { trees: vec![tree], l: vec![], inverse_root_d: vec![], v: vec![], rhs: vec![] }
    }

    /// Returns the layout that the trees share.
    pub fn layout<'a>(&self, trees: &'a Trees) -> &'a Layout {
        &trees.all[self.trees[0]].layout
    }

    /// Fills the lanes with the numbers of the trees. Lanes without a tree repeat those of the first tree, so
    /// that their values stay finite.
    #[inline(always)]
    fn gather<'a>(&self, of: impl Fn(usize) -> &'a [f64], lanes: &mut Vec<Abreast>) {
        let first = of(self.trees[0]);
        let sources: [&[f64]; ABREAST] =
            from_fn(|lane| self.trees.get(lane).map_or(first, |tree| &of(*tree)[..first.len()]));
        lanes.clear();
        lanes.extend((0..first.len()).map(|at| Abreast(from_fn(|lane| sources[lane][at]))));
    }

    /// Copies out the numbers of the tree in this lane.
    #[inline(always)]
    fn scatter(lanes: &[Abreast], lane: usize, to: &mut [f64]) {
        to.iter_mut().zip(lanes).for_each(|(to, from)| *to = from.0[lane]);
    }

    /// Loads the velocities of these trees from those of all trees.
    #[inline(always)]
    pub fn load(&self, trees: &Trees, w: &[f64], lanes: &mut Vec<Abreast>) {
        self.gather(|tree| &w[trees.offset[tree]..][..trees.all[tree].dofs()], lanes);
    }

    /// Stores the velocities of these trees among those of all trees.
    #[inline(always)]
    pub fn store(&self, offset: &[usize], lanes: &[Abreast], w: &mut [f64]) {
        for (lane, tree) in self.trees.iter().enumerate() {
            Alike::scatter(lanes, lane, &mut w[offset[*tree]..][..lanes.len()]);
        }
    }

    /// Factorises the mass matrices of the trees, and sets `w` to the whitened velocities at the end of an
    /// unconstrained step. In each lane it computes the same as `factor` for one tree.
    #[inline(always)]
    pub fn whiten(&mut self, all: &mut [Tree], offset: &[usize], dt_s: f64, w: &mut [f64]) {
        let [mut l, mut v, mut rhs] = [&mut self.l, &mut self.v, &mut self.rhs].map(std::mem::take);
        self.gather(|tree| &all[tree].factor.h, &mut l);
        self.gather(|tree| &all[tree].unconstrained, &mut v);
        self.gather(|tree| &all[tree].rhs, &mut rhs);
        (self.l, self.v, self.rhs) = (l, v, rhs);
        let layout = &all[self.trees[0]].layout;
        self.inverse_root_d.resize(layout.dofs(), Abreast::ZERO);
        self.factorise(layout);
        self.whiten_velocities(layout, dt_s);
        self.store(offset, &self.v, w);
        for (lane, tree) in self.trees.iter().enumerate() {
            let factor = &mut all[*tree].factor;
            Alike::scatter(&self.l, lane, &mut factor.h);
            Alike::scatter(&self.inverse_root_d, lane, &mut factor.inverse_root_d);
        }
    }

    #[inline(always)]
    fn factorise(&mut self, layout: &Layout) {
        for k in (0..layout.dofs()).rev() {
            let range = layout.row(k);
            let (before, from) = self.l.split_at_mut(range.start);
            let row = &mut from[..range.len()];
            let last = row.len() - 1;
            let d = row[last];
            self.inverse_root_d[k] = Abreast(d.0.map(|d| 1.0 / d.sqrt()));
            let path = layout.path(k);
            for p in (0..last).rev() {
                let share = row[p].with(d, |l, d| l / d);
                let target = layout.row(usize::from(path[p]));
                for (t, x) in before[target].iter_mut().zip(&row[..=p]) {
                    *t = *t - share * *x;
                }
                row[p] = share;
            }
        }
    }

    #[inline(always)]
    fn whiten_velocities(&mut self, layout: &Layout, dt_s: f64) {
        let dt_s = Abreast([dt_s; ABREAST]);
        for k in (0..layout.dofs()).rev() {
            let row = &self.l[layout.row(k)];
            let path = layout.path(k);
            let force = self.rhs[k];
            let mut lv = self.v[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                let j = usize::from(*j);
                self.rhs[j] = self.rhs[j] - *l * force;
                lv += *l * self.v[j];
            }
            let inverse_root_d = self.inverse_root_d[k];
            // This velocity is not needed again: only the paths of degrees of freedom further out contain it.
            self.v[k] = lv.with(inverse_root_d, |lv, inverse_root_d| lv / inverse_root_d)
                + force * dt_s * inverse_root_d;
        }
    }

    /// Computes v = L^-1 D^-1/2 w, lane by lane.
    #[inline(always)]
    pub fn unwhiten(&mut self, trees: &[Tree], offset: &[usize], w: &[f64], v: &mut [f64]) {
        let mut lanes = std::mem::take(&mut self.v);
        self.gather(|tree| &w[offset[tree]..][..trees[tree].dofs()], &mut lanes);
        let layout = &trees[self.trees[0]].layout;
        for k in 0..layout.dofs() {
            let row = &self.l[layout.row(k)];
            let path = layout.path(k);
            let mut lv = lanes[k] * self.inverse_root_d[k];
            for (l, j) in row.iter().zip(&path[..path.len() - 1]) {
                lv = lv - *l * lanes[usize::from(*j)];
            }
            lanes[k] = lv;
        }
        self.store(offset, &lanes, v);
        self.v = lanes;
    }

    /// Appends Y = D^-1/2 L^-T e_k, the whitened unit row of degree of freedom `k`, on its path. Returns Y .
    /// Y.
    #[inline(always)]
    pub fn push_unit_row(&self, layout: &Layout, k: usize, all: &mut Vec<Abreast>) -> Abreast {
        let path = layout.path(k);
        let first = all.len();
        all.resize(first + path.len() - 1, Abreast::ZERO);
        all.push(Abreast::ONE);
        let y = &mut all[first..];
        for p in (0..path.len()).rev() {
            let i = usize::from(path[p]);
            let (left, right) = y.split_at_mut(p);
            let pivot = right[0];
            for (t, l) in left.iter_mut().zip(&self.l[layout.row(i)]) {
                *t = *t - *l * pivot;
            }
            right[0] = pivot * self.inverse_root_d[i];
        }
        let mut inverse_mass = Abreast::ZERO;
        y.iter().for_each(|y| inverse_mass += *y * *y);
        inverse_mass
    }
}
