//! Sparse whitened rows of constraints.

use super::spatial::ForceVector;
use super::tree::Tree;

/// Groups of N rows that share their columns: of each group the columns that are not zero, and in them Y (see `factor`).
pub struct ConstraintRows<const N: usize> {
    pub y: Vec<[f64; N]>,
    pub column: Vec<u16>,
    /// Where each group begins, and the end of the last.
    start: Vec<usize>,
}

/// Sums that grow side by side: an addition waits for the one before it.
const CHAINS: usize = 4;

impl<const N: usize> Default for ConstraintRows<N> {
    fn default() -> Self {
        ConstraintRows { y: Vec::new(), column: Vec::new(), start: vec![0] }
    }
}

impl<const N: usize> ConstraintRows<N> {
    pub fn clear(&mut self) {
        self.y.clear();
        self.column.clear();
        self.start.truncate(1);
    }

    #[inline]
    pub fn group(&self, group: usize) -> (&[[f64; N]], &[u16]) {
        let range = self.start[group]..self.start[group + 1];
        (&self.y[range.clone()], &self.column[range])
    }

    /// Appends what wrenches about the tree's reference do on a link: J^T = S . wrench along the path, then whitened.
    pub fn push_link(&mut self, tree: &Tree, offset: usize, link: usize, wrenches: &[ForceVector; N]) {
        let Some(last) = tree.layout.last_dof[link] else { return };
        let first = self.y.len();
        for k in tree.layout.path(last) {
            let axis = tree.axis[usize::from(*k)];
            self.y.push(std::array::from_fn(|row| axis.dot(wrenches[row])));
            self.column.push(k + offset as u16);
        }
        tree.factor.whiten_rows(&tree.layout, last, &mut self.y[first..]);
    }

    /// Appends unit rows of one degree of freedom, `scale` in every row.
    pub fn push_dof(&mut self, tree: &Tree, offset: usize, dof: usize, scale: [f64; N]) {
        let first = self.y.len();
        let path = tree.layout.path(dof);
        self.column.extend(path.iter().map(|k| k + offset as u16));
        self.y.resize(first + path.len(), [0.0; N]);
        if let Some(last) = self.y.last_mut() {
            *last = scale;
        }
        tree.factor.whiten_rows(&tree.layout, dof, &mut self.y[first..]);
    }

    /// Adds a second part on the same tree, from `second` on, to the first, from `start` on, where their paths coincide.
    pub fn merge(&mut self, start: usize, second: usize) {
        let paths = (start..second).zip(second..self.column.len());
        let shared = paths.take_while(|(a, b)| self.column[*a] == self.column[*b]).count();
        for p in 0..shared {
            let more = self.y[second + p];
            for (sum, more) in self.y[start + p].iter_mut().zip(more) {
                *sum += more;
            }
        }
        self.y.copy_within(second + shared.., second);
        self.column.copy_within(second + shared.., second);
        self.y.truncate(self.y.len() - shared);
        self.column.truncate(self.column.len() - shared);
    }

    /// Ends the group that began at `start`; the groups follow each other.
    pub fn close(&mut self, start: usize) {
        debug_assert_eq!(self.start.last(), Some(&start));
        self.start.push(self.column.len());
    }

    /// Y Y^T of the last group: inverse masses.
    pub fn last_inverse_mass(&self) -> [[f64; N]; N] {
        let mut a = [[0.0; N]; N];
        let (y, _) = self.group(self.start.len() - 2);
        for y in y {
            for i in 0..N {
                for j in 0..N {
                    a[i][j] += y[i] * y[j];
                }
            }
        }
        a
    }

    /// Velocities along the rows of a group.
    #[inline]
    pub fn velocity(&self, group: usize, w: &[f64]) -> [f64; N] {
        let (y, column) = self.group(group);
        let mut sums = [[0.0; N]; CHAINS];
        let (whole, whole_columns) = (y.chunks_exact(CHAINS), column.chunks_exact(CHAINS));
        let (rest, rest_columns) = (whole.remainder(), whole_columns.remainder());
        for (y, column) in whole.zip(whole_columns) {
            for chain in 0..CHAINS {
                let w = w[usize::from(column[chain])];
                for c in 0..N {
                    sums[chain][c] += y[chain][c] * w;
                }
            }
        }
        for (chain, (y, column)) in rest.iter().zip(rest_columns).enumerate() {
            let w = w[usize::from(*column)];
            for c in 0..N {
                sums[chain][c] += y[c] * w;
            }
        }
        std::array::from_fn(|c| sums.iter().map(|sum| sum[c]).sum())
    }

    /// Adds the impulses of a group.
    #[inline]
    pub fn push_impulse(&self, group: usize, impulse: &[f64; N], w: &mut [f64]) {
        let (y, column) = self.group(group);
        for (y, column) in y.iter().zip(column) {
            let mut sum = 0.0;
            for c in 0..N {
                sum += y[c] * impulse[c];
            }
            w[usize::from(*column)] += sum;
        }
    }
}
