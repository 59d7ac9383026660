//! Which trees touch each other, directly or through others: what their contacts do is theirs alone.

use crate::dynamics::contacts::Candidate;

#[derive(Default)]
pub struct Heaps {
    /// The number of its heap for every tree.
    of_tree: Vec<usize>,
    /// How many contacts of its heap come before each candidate, and the candidate.
    turns: Vec<(usize, usize)>,
    /// Contacts so far, by heap.
    counts: Vec<usize>,
}

impl Heaps {
    /// Finds the heaps of so many trees, by the points at which they may touch.
    pub fn find(&mut self, trees: usize, candidates: &[Candidate]) {
        self.of_tree.clear();
        self.of_tree.extend(0..trees);
        for candidate in candidates {
            if let [Some(one), Some(other)] = candidate.bodies {
                let [kept, joined] = [one, other].map(|body| self.of_tree[body.tree.index()]);
                self.of_tree.iter_mut().filter(|heap| **heap == joined).for_each(|heap| *heap = kept);
            }
        }
    }

    pub fn of_tree(&self, tree: usize) -> usize {
        self.of_tree[tree]
    }

    /// One of the two bodies that touch is a tree's.
    pub fn of_contact(&self, candidate: &Candidate) -> usize {
        candidate.bodies.iter().flatten().next().map_or(0, |body| self.of_tree[body.tree.index()])
    }

    /// The candidates, those of a heap in their order, and the heaps taking turns: a processor works at the same time on contacts
    /// that have no part in each other.
    pub fn in_turn(&mut self, candidates: &[Candidate]) -> impl Iterator<Item = usize> {
        self.counts.clear();
        self.counts.resize(self.of_tree.len(), 0);
        self.turns.clear();
        for (index, candidate) in candidates.iter().enumerate() {
            let heap = self.of_contact(candidate);
            self.turns.push((self.counts[heap], index));
            self.counts[heap] += 1;
        }
        self.turns.sort_unstable();
        self.turns.iter().map(|(_, candidate)| *candidate)
    }
}
