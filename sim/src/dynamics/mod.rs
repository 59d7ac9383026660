//! Articulated trees and their contacts: dynamics in reduced coordinates on the collision detection of Rapier and Parry.
//!
//! A step ([`Dynamics::step`], in `solving`) finds what is near (`contacts::near`: Rapier's broad phase) and where it touches
//! (`contacts::collision`: Parry's manifolds). Then it is, for every [`Tree`]: bias forces and mass matrix
//! (`trees::equations`), its factor M = L^T D L and whitened velocities (`trees::factor`); then rows of contacts
//! (`contacts::friction`), joints (`joints::bounds`) and equalities (`joints::equality`), Gauss-Seidel on them
//! (`solving`), and new positions (`trees::kinematics`), after which a fast tree has no energy that nothing gave it
//! (`trees::energy`). It knows no robot and no file format.
//!
//! SI units, radians, world axes with z wherever gravity says, f64 throughout. The same sequence of calls gives the same
//! bits: trees and colliders count in the order in which they were added, and so do contacts.

mod contacts;
mod energy_balance;
mod joints;
mod settings;
mod snapshot;
mod solving;
#[cfg(test)]
mod tests;
mod trees;

pub use contacts::ContactPoint;
pub use contacts::collider::{Collider, ColliderId, Mask};
pub use contacts::friction::{Directions, Friction};
pub use energy_balance::{EnergyBalance, EnergyBefore};
pub use joints::equality::{Equality, EqualityId};
pub use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};
pub use settings::{Settings, Softness};
pub use snapshot::{DynamicsState, OtherWorld};
pub use solving::Diverged;
pub use trees::link::{Axis, Drive, Joint, Link, Mass};
pub(crate) use trees::spatial::rounded;
pub use trees::state::TreeState;
pub use trees::tree::{Tree, TreeError};
pub use trees::{LinkId, TreeId};

use contacts::collision::Collision;
use solving::Solver;
use trees::Trees;

/// Everything that moves in a world.
pub struct Dynamics {
    pub settings: Settings,
    trees: Trees,
    collision: Collision,
    solver: Solver,
    /// Velocities of all trees by which positions move, and those at the end of the step.
    moving_v: Vec<f64>,
    final_v: Vec<f64>,
}

impl Dynamics {
    pub fn new(settings: Settings) -> Dynamics {
        Dynamics {
            settings,
            trees: Trees::default(),
            collision: Collision::default(),
            solver: Solver::default(),
            moving_v: Vec::new(),
            final_v: Vec::new(),
        }
    }

    pub fn add_tree(&mut self, tree: Tree) -> TreeId {
        let id = self.trees.push(tree);
        let dofs = self.trees.dofs();
        self.solver.w.resize(dofs);
        self.moving_v.resize(dofs, 0.0);
        self.final_v.resize(dofs, 0.0);
        id
    }

    /// Adds a collider; it has no mass.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        self.collision.add(collider, &self.trees, &self.settings)
    }

    /// Lets these links never touch from now on. It has to be called before the first step.
    pub fn keep_apart(&mut self, a: LinkId, b: LinkId) {
        self.collision.keep_apart(a, b);
    }

    /// Lets these colliders never touch from now on. It has to be called before the first step.
    pub fn keep_colliders_apart(&mut self, a: ColliderId, b: ColliderId) {
        self.collision.keep_colliders_apart(a, b);
    }

    pub fn add_equality(&mut self, equality: Equality, active: bool) -> EqualityId {
        self.solver.equalities.push(equality, active)
    }

    /// Switches an equality on or off: locks and opens a latch.
    pub fn set_active(&mut self, equality: EqualityId, active: bool) {
        self.solver.equalities.set_active(equality, active);
    }

    /// All trees, in the order in which they were added.
    pub fn tree_ids(&self) -> impl Iterator<Item = TreeId> + use<> {
        self.trees.ids()
    }

    pub fn tree(&self, id: TreeId) -> &Tree {
        &self.trees.all[id.index()]
    }

    pub fn tree_mut(&mut self, id: TreeId) -> &mut Tree {
        &mut self.trees.all[id.index()]
    }

    pub fn collider(&self, id: ColliderId) -> &Collider {
        self.collision.collider(id)
    }

    /// All colliders that a link carries.
    pub fn colliders_on(&self, link: LinkId) -> Vec<ColliderId> {
        let numbered = self.collision.colliders().zip(0..);
        numbered.filter(|(collider, _)| collider.on == Some(link)).map(|(_, id)| ColliderId(id)).collect()
    }

    /// Leaves colliders of this tag only a share of their friction; see [`Friction::left`].
    pub fn leave_friction(&mut self, tag: u128, share: f64) {
        let of_tag = self.collision.colliders_mut().filter(|collider| collider.tag == tag);
        of_tag.for_each(|collider| collider.friction.left = share);
    }

    /// All colliders, in the order in which they were added, and where they are.
    pub fn colliders(&self) -> impl Iterator<Item = (&Collider, DPose3)> {
        let world_from = |link: &LinkId| self.trees.world_from(*link);
        self.collision.colliders().map(move |collider| {
            let world_from_body = collider.on.as_ref().map_or(DPose3::IDENTITY, world_from);
            (collider, world_from_body * collider.body_from_shape)
        })
    }

    /// All points of contact of the last step.
    pub fn touches(&self) -> &[ContactPoint] {
        &self.solver.touches
    }

    /// What pressed on a collider in the last step: the other collider and the force on this one (N, world axes),
    /// friction included, point by point.
    pub fn forces_on(&self, collider: ColliderId) -> impl Iterator<Item = (ColliderId, DVec3)> {
        let per_s = 1.0 / self.settings.dt_s;
        self.touches().iter().filter_map(move |touch| match touch.colliders {
            [other, this] if this == collider => Some((other, touch.impulse_n_s * per_s)),
            [this, other] if this == collider => Some((other, touch.impulse_n_s * -per_s)),
            _ => None,
        })
    }
}
