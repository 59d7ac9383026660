//! Articulated trees and their contacts: dynamics in reduced coordinates on the collision detection of
//! Rapier and Parry.
//!
//! A step ([`Dynamics::step`], in `solving`) finds pairs that are near (`contacts::near`: Rapier's broad
//! phase) and their contact points (`contacts::collision`: Parry's manifolds). For every [`Tree`] it
//! then computes bias forces and the mass matrix (`trees::equations`), its factor M = L^T D L and
//! whitened velocities (`trees::factor`). It builds rows of contacts (`contacts::friction`), joints
//! (`joints::bounds`) and equalities (`joints::equality`), and runs Gauss-Seidel on them (`solving`).
//! Finally it computes new positions (`trees::kinematics`), and removes spurious energy from fast trees
//! (`trees::energy`). This module does not depend on robots or file formats.
//!
//! SI units, radians, f64 throughout. The direction of gravity in the world axes is a setting. The same
//! sequence of calls gives the same bits: trees and colliders are numbered in the order in which they
//! were added, and so are contacts.

mod contacts;
mod energy_balance;
mod joints;
mod rest;
mod settings;
mod sleep;
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
use sleep::SleepingContacts;
use solving::Solver;
use trees::Trees;

/// All moving bodies of a world.
pub struct Dynamics {
    pub settings: Settings,
    trees: Trees,
    collision: Collision,
    solver: Solver,
    /// Contacts that are left out of steps.
    sleeping: SleepingContacts,
    /// Velocities of all trees by which positions move, and the velocities at the end of the step.
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
            sleeping: SleepingContacts::default(),
            moving_v: Vec::new(),
            final_v: Vec::new(),
        }
    }

    /// Adds a tree.
    ///
    /// # Panics
    ///
    /// Panics if all trees together have more than 65535 degrees of freedom.
    pub fn add_tree(&mut self, tree: Tree) -> TreeId {
        let id = self.trees.push(tree);
        let dofs = self.trees.dofs();
        self.solver.w.resize(dofs);
        self.moving_v.resize(dofs, 0.0);
        self.final_v.resize(dofs, 0.0);
        id
    }

    /// Adds a collider; it has no mass.
    ///
    /// # Panics
    ///
    /// Panics if the shape is not convex.
    pub fn add_collider(&mut self, collider: Collider) -> ColliderId {
        self.collision.add(collider, &self.trees, &self.settings)
    }

    /// Excludes contacts between two links. Call it before the first step.
    pub fn keep_apart(&mut self, a: LinkId, b: LinkId) {
        self.collision.keep_apart(a, b);
    }

    /// Excludes contacts between two colliders. Call it before the first step.
    pub fn keep_colliders_apart(&mut self, a: ColliderId, b: ColliderId) {
        self.collision.keep_colliders_apart(a, b);
    }

    /// Lets two colliders touch with this friction, regardless of their masks, links and joints. Call it
    /// before the first step.
    pub fn let_touch(&mut self, a: ColliderId, b: ColliderId, friction: Friction) {
        self.collision.let_touch(a, b, friction);
    }

    pub fn add_equality(&mut self, equality: Equality, active: bool) -> EqualityId {
        self.solver.equalities.push(equality, active)
    }

    /// Switches an equality on or off, for example to lock and open a latch.
    pub fn set_active(&mut self, equality: EqualityId, active: bool) {
        self.solver.equalities.set_active(equality, active);
    }

    /// Returns all trees, in the order in which they were added.
    pub fn tree_ids(&self) -> impl Iterator<Item = TreeId> + use<> {
        self.trees.ids()
    }

    pub fn tree(&self, id: TreeId) -> &Tree {
        &self.trees.all[id.index()]
    }

    /// Returns a tree for modification. A sleeping tree wakes.
    pub fn tree_mut(&mut self, id: TreeId) -> &mut Tree {
        if self.trees.all[id.index()].is_asleep() {
            self.wake(id);
        }
        &mut self.trees.all[id.index()]
    }

    pub fn collider(&self, id: ColliderId) -> &Collider {
        self.collision.collider(id)
    }

    /// Returns all colliders of a link.
    pub fn colliders_on(&self, link: LinkId) -> Vec<ColliderId> {
        let numbered = self.collision.colliders().zip(0..);
        numbered.filter(|(collider, _)| collider.on == Some(link)).map(|(_, id)| ColliderId(id)).collect()
    }

    /// Reduces the friction of all colliders with this tag to a share, see [`Friction::left`].
    pub fn leave_friction(&mut self, tag: u128, share: f64) {
        let of_tag = self.collision.colliders_mut().filter(|collider| collider.tag == tag);
        of_tag.for_each(|collider| collider.friction.left = share);
    }

    /// Returns all colliders with their world poses, in the order in which they were added.
    pub fn colliders(&self) -> impl Iterator<Item = (&Collider, DPose3)> {
        let world_from = |link: &LinkId| self.trees.world_from(*link);
        self.collision.colliders().map(move |collider| {
            let world_from_body = collider.on.as_ref().map_or(DPose3::IDENTITY, world_from);
            (collider, world_from_body * collider.body_from_shape)
        })
    }

    /// Returns all contact points of the last step, those of sleeping bodies included.
    pub fn touches(&self) -> impl Iterator<Item = &ContactPoint> {
        self.solver.touches.iter().chain(&self.sleeping.touches)
    }

    /// Returns the contacts on a collider in the last step, point by point. Each entry is the other collider
    /// and the force on this one (N, world axes), friction included.
    pub fn forces_on(&self, collider: ColliderId) -> impl Iterator<Item = (ColliderId, DVec3)> {
        let per_s = 1.0 / self.settings.dt_s;
        self.touches().filter_map(move |touch| match touch.colliders {
            [other, this] if this == collider => Some((other, touch.impulse_n_s * per_s)),
            [this, other] if this == collider => Some((other, touch.impulse_n_s * -per_s)),
            _ => None,
        })
    }
}
