//! Walks to places, of robots without a load and of robots that carry or push one.

use tandem_tools_spec::{CommandReply, PoseFrame, SpecError, Tool as _, WalkTo};

use super::PlanAdvance;
use super::carry::CarryPlan;
use super::expectation::PartnerNews;
use super::walk_to::WalkPlan;
use crate::EpisodeError;
use crate::session::Session;

/// Robots that walk to their places.
#[derive(Debug)]
pub struct Walkers {
    /// Frame of the places.
    pub frame: PoseFrame,
    until_heard: bool,
    way: WalkersWay,
}

#[derive(Debug)]
enum WalkersWay {
    Free(WalkPlan),
    Carrying(CarryPlan),
}

impl Walkers {
    /// Returns the next command after the reply to the previous one.
    pub fn advance(
        &mut self,
        session: &Session,
        last: Option<&CommandReply>,
        news: &PartnerNews,
    ) -> PlanAdvance {
        match news.words().filter(|_| self.until_heard) {
            Some(words) => self.end(session, last, words),
            None => self.go_on(session, last),
        }
    }

    /// Returns the frame of the places if a load is carried to them.
    pub fn carried_in(&self) -> Option<PoseFrame> {
        matches!(self.way, WalkersWay::Carrying(_)).then_some(self.frame)
    }

    fn go_on(&mut self, session: &Session, last: Option<&CommandReply>) -> PlanAdvance {
        match &mut self.way {
            WalkersWay::Free(walk) => walk.advance(session, last),
            WalkersWay::Carrying(carry) => carry.advance(session, last),
        }
    }

    /// Ends the walk before its places. Robots that carry a load come to rest first, and so do their hands.
    pub fn end(&mut self, session: &Session, last: Option<&CommandReply>, why: String) -> PlanAdvance {
        match &mut self.way {
            WalkersWay::Free(_) => PlanAdvance::Done(Some(why)),
            WalkersWay::Carrying(carry) => {
                carry.stop(why);
                carry.advance(session, last)
            }
        }
    }
}

impl Session {
    /// Starts a walk.
    ///
    /// # Errors
    ///
    /// If the episode lacks a robot, or messages are to end a walk in an episode without messages.
    pub(super) fn walkers(&self, walk: &WalkTo, operator: Option<&str>) -> Result<Walkers, EpisodeError> {
        if walk.until_heard && operator.is_none() {
            let reason = "`until_heard` is for operators, each of whom has a robot".into();
            return Err(SpecError::Invalid { tool: WalkTo::NAME, reason }.into());
        }
        let way = match walk.carries() {
            true => self.carry_plan(walk).map(WalkersWay::Carrying)?,
            false => self.walk_plan(walk).map(WalkersWay::Free)?,
        };
        Ok(Walkers { frame: walk.frame, until_heard: walk.until_heard, way })
    }
}
