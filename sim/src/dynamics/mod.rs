//! Articulated trees and their contacts: dynamics in reduced coordinates on Rapier's collision detection.
//!
//! [`Dynamics`] owns the motion of everything that moves; Rapier's bodies hold poses for its colliders and no more. A step
//! ([`Dynamics::step`]) is, for every [`Tree`]: bias forces (`bias`), mass matrix (`inertia`), its factor M = L^T D L and
//! whitened velocities (`factor`); then rows of contacts (`pairs`, `contact`), joints (`joint_rows`) and equalities
//! (`equality`), Gauss-Seidel on them (`solver`), and new positions (`kinematics`). It knows no robot and no file format.
//!
//! SI units, radians, world axes with z wherever gravity says, f64 throughout. The same sequence of calls gives the same
//! bits: trees and colliders count in the order in which they were added, and pairs are sorted by it.

mod bias;
mod contact;
mod drive;
mod efforts;
mod equality;
mod error;
mod factor;
mod free_spin;
mod friction;
mod inertia;
mod jacobian;
mod joint_rows;
mod kinematics;
mod layout;
mod link;
mod pairs;
mod settings;
mod snapshot;
mod solver;
mod spatial;
mod state;
mod step;
#[cfg(test)]
mod tests;
mod touch;
mod tree;
mod trees;
mod whiten;

use rapier3d::prelude::{ColliderBuilder, ColliderHandle, PhysicsWorld, RigidBodyBuilder, RigidBodyHandle};

pub use drive::Drive;
pub use equality::{Equality, EqualityId};
pub use error::{Diverged, OtherWorld, TreeError};
pub use friction::{Directions, Friction};
pub use link::{Axis, Joint, Link, Mass};
pub use rapier3d::glamx::{DMat3, DPose3, DQuat, DVec3};
pub use settings::{Settings, Softness};
pub use snapshot::DynamicsState;
pub use state::TreeState;
pub use touch::Touch;
pub use tree::Tree;
pub use trees::{LinkId, TreeId};

use pairs::Pairs;
use solver::Solver;
use spatial::{pose_from_rapier, pose_to_rapier};
use trees::Trees;

/// Everything that moves in a world.
pub struct Dynamics {
    pub settings: Settings,
    trees: Trees,
    /// Rapier's body of each link.
    bodies: Vec<Vec<RigidBodyHandle>>,
    pairs: Pairs,
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
            bodies: Vec::new(),
            pairs: Pairs::default(),
            solver: Solver::default(),
            moving_v: Vec::new(),
            final_v: Vec::new(),
        }
    }

    /// Takes over a tree and gives each of its links a body for colliders. Rapier must not step these bodies itself.
    pub fn add_tree(&mut self, tree: Tree, physics: &mut PhysicsWorld) -> TreeId {
        let holder = |link| {
            let pose = pose_to_rapier(&tree.world_from_link(link));
            physics.insert_body(RigidBodyBuilder::dynamic().pose(pose).can_sleep(false))
        };
        self.bodies.push((0..tree.links().len()).map(holder).collect());
        let id = self.trees.push(tree);
        let dofs = self.trees.dofs();
        self.solver.w.resize(dofs, 0.0);
        self.moving_v.resize(dofs, 0.0);
        self.final_v.resize(dofs, 0.0);
        id
    }

    /// Inserts a collider on a link, or fixed in the world; its position is in the frame of either. Mass comes from links
    /// and friction from here, whatever the builder says.
    pub fn add_collider(
        &mut self,
        collider: ColliderBuilder,
        on: Option<LinkId>,
        friction: Friction,
        physics: &mut PhysicsWorld,
    ) -> ColliderHandle {
        let body_from_shape = pose_from_rapier(&collider.position);
        let handle = physics.insert_collider(collider.density(0.0), on.map(|link| self.body(link)));
        self.pairs.register(handle, on, body_from_shape, friction);
        handle
    }

    pub fn add_equality(&mut self, equality: Equality, active: bool) -> EqualityId {
        self.solver.equalities.push(equality, active)
    }

    /// Switches an equality on or off: locks and opens a latch.
    pub fn set_active(&mut self, equality: EqualityId, active: bool) {
        self.solver.equalities.set_active(equality, active);
    }

    pub fn tree(&self, id: TreeId) -> &Tree {
        &self.trees.all[id.index()]
    }

    pub fn tree_mut(&mut self, id: TreeId) -> &mut Tree {
        &mut self.trees.all[id.index()]
    }

    /// Rapier's body that carries a link's colliders.
    pub fn body(&self, id: LinkId) -> RigidBodyHandle {
        self.bodies[id.tree.index()][id.link]
    }

    /// All points of contact of the last step.
    pub fn touches(&self) -> &[Touch] {
        &self.solver.touches
    }

    /// What pressed on a collider in the last step: the other collider and the force on this one (N, world axes),
    /// friction included, point by point.
    pub fn forces_on(&self, collider: ColliderHandle) -> impl Iterator<Item = (ColliderHandle, DVec3)> {
        let per_s = 1.0 / self.settings.dt_s;
        self.touches().iter().filter_map(move |touch| match touch.colliders {
            [other, this] if this == collider => Some((other, touch.impulse_n_s * per_s)),
            [this, other] if this == collider => Some((other, touch.impulse_n_s * -per_s)),
            _ => None,
        })
    }
}
