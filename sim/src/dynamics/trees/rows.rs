//! Sparse whitened constraint rows, and the velocities that they act on.

use std::ops::{Deref, DerefMut, Range};

use pulp::Simd;

use super::spatial::ForceVector;
use super::tree::Tree;

/// Groups of N rows with the same non-zero columns, and the entries of Y in these columns (see `factor`).
pub struct ConstraintRows<const N: usize> {
    /// Entries of the last group, column by column, until another group begins.
    y: Vec<[f64; N]>,
    column: Vec<u16>,
    /// The blocks of all groups.
    blocks: Vec<RowBlock<N>>,
    groups: Vec<Range<usize>>,
}

/// Columns processed side by side: the sums over every fourth column of a group are independent of each
/// other.
const SIDE: usize = 4;

/// Columns that are adjacent both in their group and among all columns, each at its position in the partial
/// sums. Other positions do not belong to the group.
struct RowBlock<const N: usize> {
    /// Entries of Y; zero at positions outside the group.
    y: [Quad; N],
    /// Bits that are combined with the sum: +0 at positions of the group, and -0 at all others, whose
    /// addition changes nothing.
    nothing: Quad,
    /// Start of the block in [`Whitened`].
    first: usize,
}

#[derive(Clone, Copy, Default)]
#[repr(align(32))]
struct Quad([f64; SIDE]);

/// Whitened velocities of all trees, with margins at both ends for blocks that extend beyond the trees.
pub struct Whitened(Vec<f64>);

const MARGIN: usize = SIDE - 1;

impl Default for Whitened {
    fn default() -> Self {
        Whitened(vec![0.0; 2 * MARGIN])
    }
}

impl Whitened {
    pub fn resize(&mut self, dofs: usize) {
        self.0.resize(dofs + 2 * MARGIN, 0.0);
    }

    /// Clears the values that a diverged step may have left in the margins.
    pub fn clear_margins(&mut self) {
        let end = self.0.len() - MARGIN;
        self.0[..MARGIN].fill(0.0);
        self.0[end..].fill(0.0);
    }
}

impl Deref for Whitened {
    type Target = [f64];

    fn deref(&self) -> &[f64] {
        &self.0[MARGIN..self.0.len() - MARGIN]
    }
}

impl DerefMut for Whitened {
    fn deref_mut(&mut self) -> &mut [f64] {
        let end = self.0.len() - MARGIN;
        &mut self.0[MARGIN..end]
    }
}

impl<const N: usize> Default for ConstraintRows<N> {
    fn default() -> Self {
        ConstraintRows { y: Vec::new(), column: Vec::new(), blocks: Vec::new(), groups: Vec::new() }
    }
}

impl<const N: usize> ConstraintRows<N> {
    pub fn clear(&mut self) {
        self.blocks.clear();
        self.groups.clear();
    }

    /// Begins a group. The columns of a group are contiguous.
    pub fn begin(&mut self) {
        self.y.clear();
        self.column.clear();
    }

    /// Returns the present number of columns of the group.
    pub fn columns(&self) -> usize {
        self.column.len()
    }

    /// Appends the effect of wrenches about the tree's reference on a link: J^T = S . wrench along the
    /// path, then whitened.
    #[inline(always)]
    pub fn push_link<S: Simd>(
        &mut self,
        simd: S,
        tree: &Tree,
        offset: usize,
        link: usize,
        wrenches: &[ForceVector; N],
    ) {
        let Some(last) = tree.layout.last_dof[link] else { return };
        let first = self.y.len();
        for k in tree.layout.path(last) {
            let axis = tree.axis[usize::from(*k)];
            self.y.push(std::array::from_fn(|row| axis.dot(wrenches[row])));
            self.column.push(k + offset as u16);
        }
        tree.factor.whiten_rows(simd, &tree.layout, last, &mut self.y[first..]);
    }

    /// Appends unit rows of one degree of freedom, multiplied by the row's `scale`.
    #[inline(always)]
    pub fn push_dof<S: Simd>(&mut self, simd: S, tree: &Tree, offset: usize, dof: usize, scale: [f64; N]) {
        let first = self.y.len();
        let path = tree.layout.path(dof);
        self.column.extend(path.iter().map(|k| k + offset as u16));
        self.y.resize(first + path.len(), [0.0; N]);
        if let Some(last) = self.y.last_mut() {
            *last = scale;
        }
        tree.factor.whiten_rows(simd, &tree.layout, dof, &mut self.y[first..]);
    }

    /// Adds a second part of the group on the same tree, which begins at column `second`, to the first part
    /// where their paths coincide.
    pub fn merge(&mut self, second: usize) {
        let paths = (0..second).zip(second..self.column.len());
        let shared = paths.take_while(|(a, b)| self.column[*a] == self.column[*b]).count();
        for p in 0..shared {
            let more = self.y[second + p];
            for (sum, more) in self.y[p].iter_mut().zip(more) {
                *sum += more;
            }
        }
        self.y.copy_within(second + shared.., second);
        self.column.copy_within(second + shared.., second);
        self.y.truncate(self.y.len() - shared);
        self.column.truncate(self.column.len() - shared);
    }

    /// Ends the group. Returns the inverse masses Y Y^T.
    #[inline(always)]
    pub fn close(&mut self) -> [[f64; N]; N] {
        let first = self.blocks.len();
        let mut place = 0;
        while place < self.column.len() {
            place += self.push_block(place);
        }
        self.groups.push(first..self.blocks.len());
        let mut a = [[0.0; N]; N];
        for y in &self.y {
            for i in 0..N {
                for j in 0..N {
                    a[i][j] += y[i] * y[j];
                }
            }
        }
        a
    }

    /// Makes a block of the column at this position in the group and its neighbours. Returns their number.
    #[inline(always)]
    fn push_block(&mut self, place: usize) -> usize {
        let begin = place % SIDE;
        let column = &self.column[place..self.column.len().min(place + SIDE - begin)];
        let are_neighbours = |pair: &[u16]| pair[0] + 1 == pair[1];
        let count = 1 + column.windows(2).take_while(|pair| are_neighbours(pair)).count();
        let first = usize::from(column[0]) + MARGIN - begin;
        let y = &self.y[place..place + count];
        if let Some(y) = y.first_chunk::<SIDE>() {
            let y = std::array::from_fn(|row| Quad(y.map(|y| y[row])));
            self.blocks.push(RowBlock { y, nothing: Quad::default(), first });
            return SIDE;
        }
        // The rows are filled in place: moving data just written number by number would stall the processor.
        self.blocks.push(RowBlock { y: [Quad::default(); N], nothing: Quad([-0.0; SIDE]), first });
        if let Some(block) = self.blocks.last_mut() {
            for (side, y) in (begin..).zip(y) {
                block.nothing.0[side] = 0.0;
                for (row, y) in block.y.iter_mut().zip(y) {
                    row.0[side] = *y;
                }
            }
        }
        count
    }

    /// Returns the velocities along the rows of a group.
    #[inline(always)]
    pub fn velocity(&self, group: usize, w: &Whitened) -> [f64; N] {
        let mut sums = [[0.0; SIDE]; N];
        for RowBlock { y, first, .. } in &self.blocks[self.groups[group].clone()] {
            let w = &w.0[*first..*first + SIDE];
            for (sums, y) in sums.iter_mut().zip(y) {
                for side in 0..SIDE {
                    sums[side] += y.0[side] * w[side];
                }
            }
        }
        let side = |side: usize| -> [f64; N] { std::array::from_fn(|row| sums[row][side]) };
        let [first, second, third, fourth] = [side(0), side(1), side(2), side(3)];
        std::array::from_fn(|row| first[row] + second[row] + third[row] + fourth[row])
    }

    /// Adds the impulses of a group.
    #[inline(always)]
    pub fn push_impulse(&self, group: usize, impulse: &[f64; N], w: &mut Whitened) {
        for RowBlock { y, nothing, first } in &self.blocks[self.groups[group].clone()] {
            let mut sums = [0.0; SIDE];
            for (y, impulse) in y.iter().zip(impulse) {
                sums.iter_mut().zip(y.0).for_each(|(sum, y)| *sum += y * impulse);
            }
            let w = &mut w.0[*first..*first + SIDE];
            for side in 0..SIDE {
                w[side] += f64::from_bits(sums[side].to_bits() | nothing.0[side].to_bits());
            }
        }
    }
}
