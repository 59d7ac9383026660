//! Walks to places: of robots that are free, and of those that carry or push a load.

use tandem_tools_spec::{CommandReply, WalkTo};

use super::PlanAdvance;
use super::carry::CarryPlan;
use super::walk_to::WalkPlan;
use crate::EpisodeError;
use crate::session::Session;

/// Robots that walk to their places.
#[derive(Debug)]
pub enum Walkers {
    Free(WalkPlan),
    Carrying(CarryPlan),
}

impl Walkers {
    /// Returns the next command after the reply to the previous one.
    pub fn advance(&mut self, session: &Session, last: Option<&CommandReply>) -> PlanAdvance {
        match self {
            Walkers::Free(walk) => walk.advance(session, last),
            Walkers::Carrying(carry) => carry.advance(session, last),
        }
    }
}

impl Session {
    /// Starts a walk.
    ///
    /// # Errors
    ///
    /// A robot that the episode does not have.
    pub(super) fn walkers(&self, walk: &WalkTo) -> Result<Walkers, EpisodeError> {
        match walk.robots.iter().any(|entry| entry.carry == Some(true)) {
            true => self.carry_plan(walk).map(Walkers::Carrying),
            false => self.walk_plan(walk).map(Walkers::Free),
        }
    }
}
