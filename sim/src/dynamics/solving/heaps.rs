//! Contact islands, called heaps here: trees that touch each other, directly or through others. Contacts of
//! one heap do not affect another heap.

use crate::dynamics::contacts::Candidate;

#[derive(Default)]
pub struct Heaps {
    /// Heap of each tree.
    of_tree: Vec<usize>,
    /// Number of contacts of the same heap before each candidate, and the candidate.
    turns: Vec<(usize, usize)>,
    /// Running count of contacts, by heap.
    counts: Vec<usize>,
}

impl Heaps {
    /// Finds the heaps of `trees` trees from the points at which they may touch.
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

    /// Returns the heap of a contact. At least one of its two bodies belongs to a tree.
    pub fn of_contact(&self, candidate: &Candidate) -> usize {
        candidate.bodies.iter().flatten().next().map_or(0, |body| self.of_tree[body.tree.index()])
    }

    /// Returns the candidates with heaps taking turns; candidates of one heap stay in order. A processor can
    /// then work on independent contacts at the same time.
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
