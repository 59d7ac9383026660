//! Saving and restoring all state that outlasts a step.

use serde::{Deserialize, Serialize};
use thiserror::Error;

use super::Dynamics;
use super::contacts::ContactPoint;
use super::contacts::collision::Manifold;
use super::joints::equality::EqualityState;
use super::rest::Rest;
use super::sleep::SleepingContacts;
use super::trees::state::TreeState;

/// State of all trees, equalities and contacts, in full precision.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct DynamicsState {
    pub(super) trees: Vec<TreeState>,
    equalities: Vec<EqualityState>,
    touches: Vec<ContactPoint>,
    manifolds: Vec<Manifold>,
    /// State of bodies that may sleep.
    rests: Vec<Rest>,
    sleeping: SleepingContacts,
}

/// Error of restoring a state that belongs to another world.
#[derive(Debug, Error, PartialEq)]
#[error(
    "the state has other trees or equalities than this world; one taken from a world of the same making \
     would fit"
)]
pub struct OtherWorld;

/// [`DynamicsState`] by reference, without the state of bodies that may sleep.
#[derive(Serialize)]
struct PresentState<'a> {
    trees: Vec<TreeState>,
    equalities: &'a [EqualityState],
    touches: &'a [ContactPoint],
    manifolds: &'a [Manifold],
}

impl Dynamics {
    /// Returns a view of the present state for immediate serialisation. [`Dynamics::resting`] returns the
    /// rest of the state.
    pub fn present(&self) -> impl Serialize {
        PresentState {
            trees: self.trees.all.iter().map(|tree| tree.state()).collect(),
            equalities: &self.solver.equalities.memory,
            touches: &self.solver.touches,
            manifolds: &self.collision.manifolds,
        }
    }

    pub fn state(&self) -> DynamicsState {
        DynamicsState {
            trees: self.trees.all.iter().map(|tree| tree.state()).collect(),
            equalities: self.solver.equalities.memory.clone(),
            touches: self.solver.touches.clone(),
            manifolds: self.collision.manifolds.clone(),
            rests: self.rests(),
            sleeping: self.sleeping.clone(),
        }
    }

    /// Restores a state of this world, or of one built the same way.
    ///
    /// # Errors
    ///
    /// Returns [`OtherWorld`], and makes no change, if the state does not fit.
    pub fn restore(&mut self, state: &DynamicsState) -> Result<(), OtherWorld> {
        let trees = &mut self.trees.all;
        let fits = trees.len() == state.trees.len()
            && self.solver.equalities.memory.len() == state.equalities.len()
            && trees.iter().filter(|tree| tree.rest.is_some()).count() == state.rests.len()
            && trees.iter().zip(&state.trees).all(|(tree, state)| tree.fits(state));
        if !fits {
            return Err(OtherWorld);
        }
        for (tree, state) in trees.iter_mut().zip(&state.trees) {
            tree.restore(state);
        }
        self.solver.equalities.memory.clone_from(&state.equalities);
        self.solver.touches.clone_from(&state.touches);
        self.collision.manifolds.clone_from(&state.manifolds);
        let may_sleep = self.trees.all.iter_mut().filter_map(|tree| tree.rest.as_mut());
        may_sleep.zip(&state.rests).for_each(|(rest, state)| *rest = *state);
        self.sleeping.clone_from(&state.sleeping);
        self.collision.place_sleepers();
        Ok(())
    }
}
