//! Trees of a world, and the offsets of their degrees of freedom.

pub mod abreast;
pub mod energy;
mod equations;
mod factor;
mod free_spin;
mod kinematics;
mod layout;
pub mod link;
pub mod rows;
pub mod spatial;
pub mod state;
pub mod tree;

use pulp::Simd;
use rapier3d::glamx::{DPose3, DVec3};
use serde::{Deserialize, Serialize};

use abreast::{ABREAST, Alike};
use layout::Layout;
use rows::ConstraintRows;
use spatial::ForceVector;
use tree::Tree;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TreeId(pub(in crate::dynamics) u16);

/// Identifier of a link: its tree and its index in the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct LinkId {
    pub tree: TreeId,
    pub link: usize,
}

impl TreeId {
    pub fn link(self, link: usize) -> LinkId {
        LinkId { tree: self, link }
    }

    #[inline]
    pub(crate) fn index(self) -> usize {
        usize::from(self.0)
    }
}

#[derive(Default)]
pub struct Trees {
    pub all: Vec<Tree>,
    /// Index of each tree's first degree of freedom among those of all trees.
    pub offset: Vec<usize>,
    /// Trees with joints, grouped by layout, and trees without joints.
    pub alike: Vec<Alike>,
    pub jointless: Vec<usize>,
}

impl Trees {
    pub fn push(&mut self, tree: Tree) -> TreeId {
        let offset = self.dofs();
        assert!(
            offset + tree.dofs() <= usize::from(u16::MAX),
            "a world of more than 65535 degrees of freedom"
        );
        let id = TreeId(self.all.len() as u16);
        self.offset.push(offset);
        if tree.links.iter().any(|link| link.joint.axis().is_some()) {
            self.set_beside(&tree.layout);
        } else {
            self.jointless.push(self.all.len());
        }
        self.all.push(tree);
        id
    }

    /// Adds the next tree to the group of its layout.
    fn set_beside(&mut self, layout: &Layout) {
        let next = self.all.len();
        let is_like = |alike: &&mut Alike| self.all[alike.trees[0]].layout == *layout;
        match self.alike.iter_mut().filter(|alike| alike.trees.len() < ABREAST).find(is_like) {
            Some(alike) => alike.trees.push(next),
            None => self.alike.push(Alike::begin(next)),
        }
    }

    pub fn ids(&self) -> impl Iterator<Item = TreeId> + use<> {
        (0..self.all.len() as u16).map(TreeId)
    }

    pub fn dofs(&self) -> usize {
        self.offset.last().zip(self.all.last()).map_or(0, |(offset, tree)| offset + tree.dofs())
    }

    /// Returns each tree with its range among the degrees of freedom of all trees.
    pub fn ranges(&mut self) -> impl Iterator<Item = (&mut Tree, std::ops::Range<usize>)> {
        self.all.iter_mut().zip(&self.offset).map(|(tree, offset)| {
            let range = *offset..offset + tree.dofs();
            (tree, range)
        })
    }

    /// Factorises all mass matrices, and sets `w` to the whitened velocities at the end of an
    /// unconstrained step.
    #[inline(always)]
    pub fn whiten(&mut self, dt_s: f64, w: &mut [f64]) {
        for alike in &mut self.alike {
            alike.whiten(&mut self.all, &self.offset, dt_s, w);
        }
        for index in &self.jointless {
            let (tree, offset) = (&mut self.all[*index], self.offset[*index]);
            let own_w = &mut w[offset..offset + tree.dofs()];
            if tree.is_asleep() {
                own_w.fill(0.0);
                continue;
            }
            tree.factor.factorise(&tree.layout);
            tree.factor.whiten(&tree.layout, dt_s, &tree.unconstrained, &mut tree.rhs, own_w);
        }
    }

    /// Computes the velocities of all trees from the whitened ones.
    #[inline(always)]
    pub fn unwhiten(&mut self, w: &[f64], v: &mut [f64]) {
        for alike in &mut self.alike {
            alike.unwhiten(&self.all, &self.offset, w, v);
        }
        for index in &self.jointless {
            let (tree, offset) = (&self.all[*index], self.offset[*index]);
            let own = offset..offset + tree.dofs();
            if tree.is_asleep() {
                v[own].fill(0.0);
                continue;
            }
            tree.factor.unwhiten(&tree.layout, &w[own.clone()], &mut v[own]);
        }
    }

    /// Returns true if a link can move. A link that cannot move is part of the world.
    pub fn moves(&self, link: LinkId) -> bool {
        self.all[link.tree.index()].layout.last_dof[link.link].is_some()
    }

    pub fn spin_rad_s(&self, link: LinkId) -> f64 {
        self.all[link.tree.index()].link_spin_rad_s(link.link).length()
    }

    pub fn world_from(&self, link: LinkId) -> DPose3 {
        self.all[link.tree.index()].world_from_link(link.link)
    }

    /// Appends N rows, whose unit impulses apply `wrenches` to the second body and the opposite to the first.
    /// A body that is `None` is the world. `wrenches` takes the tree's reference point. Returns the inverse
    /// masses.
    #[inline(always)]
    pub fn push_rows<S: Simd, const N: usize>(
        &self,
        simd: S,
        rows: &mut ConstraintRows<N>,
        bodies: [Option<LinkId>; 2],
        wrenches: impl Fn(DVec3) -> [ForceVector; N],
    ) -> [[f64; N]; N] {
        rows.begin();
        let mut second = 0;
        for (side, body) in bodies.into_iter().enumerate() {
            second = if side == 1 { rows.columns() } else { second };
            let Some(body) = body else { continue };
            let index = body.tree.index();
            let tree = &self.all[index];
            let mut on_tree = wrenches(tree.reference_m);
            if side == 0 {
                on_tree = on_tree.map(|wrench| -wrench);
            }
            rows.push_link(simd, tree, self.offset[index], body.link, &on_tree);
        }
        if let [Some(a), Some(b)] = bodies
            && a.tree == b.tree
        {
            rows.merge(second);
        }
        rows.close()
    }
}
