//! Whitened rows of single degrees of freedom. Those of joints that follow each other on one path are made side by side.

use pulp::Simd;

use crate::dynamics::trees::Trees;
use crate::dynamics::trees::tree::Tree;

#[derive(Default)]
pub struct UnitRows {
    /// Y by its columns, those of the longest row of so many that are side by side.
    y: Vec<[f64; ABREAST]>,
    /// By their links, and of equal links by their trees.
    pub all: Vec<UnitRow>,
}

/// The row of one joint.
#[derive(Clone, Copy)]
pub struct UnitRow {
    pub tree: usize,
    pub link: usize,
    /// Where its columns begin, and which number of each is its own.
    first: usize,
    lane: usize,
}

const ABREAST: usize = 8;

impl UnitRows {
    /// Makes the rows of all joints that are wanted. The trees are factorised.
    #[inline(always)]
    pub fn make<S: Simd>(&mut self, simd: S, trees: &Trees, is_wanted: impl Fn(&Tree, usize) -> bool) {
        self.y.clear();
        self.all.clear();
        for (index, tree) in trees.all.iter().enumerate() {
            let mut begun = self.all.len();
            for link in (0..tree.links.len()).filter(|link| is_wanted(tree, *link)) {
                let together = &self.all[begun..];
                let joins = together.last().is_none_or(|last| is_on_path(tree, last.link, link));
                if !joins || together.len() == ABREAST {
                    self.whiten(simd, tree, begun);
                    begun = self.all.len();
                }
                let lane = self.all.len() - begun;
                self.all.push(UnitRow { tree: index, link, first: 0, lane });
            }
            self.whiten(simd, tree, begun);
        }
        self.all.sort_unstable_by_key(|row| (row.link, row.tree));
    }

    /// Makes the last rows, from `begun` on, each of which is on the path to the last.
    #[inline(always)]
    fn whiten<S: Simd>(&mut self, simd: S, tree: &Tree, begun: usize) {
        let Some(last) = self.all[begun..].last() else { return };
        let last = tree.layout.first_dof[last.link];
        let first = self.y.len();
        self.y.resize(first + tree.layout.path(last).len(), [0.0; ABREAST]);
        for row in &mut self.all[begun..] {
            row.first = first;
            let length = tree.layout.path(tree.layout.first_dof[row.link]).len();
            self.y[first + length - 1][row.lane] = 1.0;
        }
        tree.factor.whiten_rows(simd, &tree.layout, last, &mut self.y[first..]);
    }

    /// Y of a row by its columns.
    #[inline(always)]
    pub fn y(&self, row: &UnitRow) -> impl Iterator<Item = f64> {
        self.y[row.first..].iter().map(move |y| y[row.lane])
    }
}

/// Whether the joint of one link is on the path to that of another.
fn is_on_path(tree: &Tree, link: usize, other: usize) -> bool {
    let [dof, other] = [link, other].map(|link| tree.layout.first_dof[link]);
    let place = tree.layout.path(dof).len() - 1;
    tree.layout.path(other).get(place).is_some_and(|on_path| usize::from(*on_path) == dof)
}
