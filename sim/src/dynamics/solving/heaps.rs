//! Which trees touch each other, directly or through others: what their contacts do is theirs alone.

use crate::dynamics::contacts::Candidate;

/// The number of its heap for every tree.
pub struct Heaps(Vec<usize>);

impl Heaps {
    /// Heaps of so many trees, by the points at which they may touch.
    pub fn of(trees: usize, candidates: &[Candidate]) -> Heaps {
        let mut heaps: Vec<usize> = (0..trees).collect();
        for candidate in candidates {
            if let [Some(one), Some(other)] = candidate.bodies {
                let [kept, joined] = [heaps[one.tree.index()], heaps[other.tree.index()]];
                heaps.iter_mut().filter(|heap| **heap == joined).for_each(|heap| *heap = kept);
            }
        }
        Heaps(heaps)
    }

    pub fn of_tree(&self, tree: usize) -> usize {
        self.0[tree]
    }

    /// One of the two bodies that touch is a tree's.
    pub fn of_contact(&self, candidate: &Candidate) -> usize {
        candidate.bodies.iter().flatten().next().map_or(0, |body| self.0[body.tree.index()])
    }
}
