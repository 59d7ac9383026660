//! All trees of a world, and where each one's degrees of freedom lie among all.

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

use rows::ConstraintRows;
use spatial::ForceVector;
use tree::Tree;

#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct TreeId(pub(in crate::dynamics) u16);

/// A link of a tree of a world.
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
    /// First degree of freedom of each tree among all.
    pub offset: Vec<usize>,
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
        self.all.push(tree);
        id
    }

    pub fn ids(&self) -> impl Iterator<Item = TreeId> + use<> {
        (0..self.all.len() as u16).map(TreeId)
    }

    pub fn dofs(&self) -> usize {
        self.offset.last().zip(self.all.last()).map_or(0, |(offset, tree)| offset + tree.dofs())
    }

    /// Each tree with its range among all degrees of freedom.
    pub fn ranges(&mut self) -> impl Iterator<Item = (&mut Tree, std::ops::Range<usize>)> {
        self.all.iter_mut().zip(&self.offset).map(|(tree, offset)| {
            let range = *offset..offset + tree.dofs();
            (tree, range)
        })
    }

    /// Whether something moves a link; without, it is part of the world.
    pub fn moves(&self, link: LinkId) -> bool {
        self.all[link.tree.index()].layout.last_dof[link.link].is_some()
    }

    pub fn world_from(&self, link: LinkId) -> DPose3 {
        self.all[link.tree.index()].world_from_link(link.link)
    }

    /// Appends N rows whose unit impulses act on the second body as `wrenches` says and on the first as its opposite;
    /// `None` is the world. `wrenches` gets the tree's reference point. Returns the inverse masses.
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
