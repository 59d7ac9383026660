//! Phases of an episode and the times at which they are reached. A phase is evaluated only once its
//! predecessors have been reached.

use std::fmt;
use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::Facts;

/// A condition that holds or does not hold at a control step.
pub type Condition = Arc<dyn Predicate>;

/// An expression over the facts of a control step.
pub trait Predicate: Send + Sync {
    /// Returns `true` if it holds at this control step.
    fn holds(&self, facts: &Facts) -> bool;
}

impl<F: Fn(&Facts) -> bool + Send + Sync> Predicate for F {
    fn holds(&self, facts: &Facts) -> bool {
        self(facts)
    }
}

/// Function that returns a nearness, from 0 to 1.
pub type Nearness = Arc<dyn Fn(&Facts) -> f32 + Send + Sync>;

/// One scored phase.
#[derive(Clone)]
pub struct Phase {
    pub id: String,
    /// Description of when the phase counts as reached, for people and policies.
    pub description: String,
    /// True if the phase needs more than one robot.
    pub collaborative: bool,
    pub done: Done,
    /// Nearness of the phase, from 0 to 1, once its predecessors have been reached. It is used for dense
    /// rewards of learners only.
    pub nearness: Nearness,
}

/// Rule for reaching a phase. Conditions see one control step at a time; sequences in time are expressed
/// here.
#[derive(Clone)]
pub enum Done {
    /// It is reached as soon as the condition holds.
    When(Condition),
    /// It is reached when `then` holds after `first` held. A step at which `broken` holds in between
    /// requires `first` again.
    Sequence { first: Condition, then: Condition, broken: Option<Condition> },
    /// It is reached when `condition` has held without a break for `for_s`, and `at_end` holds at that
    /// time, too.
    Lasting { condition: Condition, for_s: f64, at_end: Option<Condition> },
    /// It is reached when every one of these has been passed, in any order.
    Milestones(Vec<Milestone>),
    /// It is reached by the rule `done`, unless `spoiled` has held at any step since the previous phase was
    /// reached.
    Unless { spoiled: Condition, done: Box<Done> },
}

/// One of several conditions that each have to hold once.
#[derive(Clone)]
pub struct Milestone {
    pub condition: Condition,
    /// Duration for which the condition has to hold without interruption.
    pub for_s: f64,
}

impl fmt::Debug for Phase {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.debug_struct("Phase").field("id", &self.id).finish_non_exhaustive()
    }
}

impl Phase {
    /// Returns the name of phase number `index` in results: `p1` for the first.
    pub fn number(index: usize) -> String {
        format!("p{}", index + 1)
    }
}

/// The progress of one episode.
#[derive(Clone, Debug)]
pub struct PhaseTracker {
    phases: Arc<[Phase]>,
    memory: PhaseMemory,
}

/// Memory of a [`PhaseTracker`] between control steps.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub struct PhaseMemory {
    /// Time at which each phase was reached, in simulated seconds.
    reached_s: Vec<f64>,
    /// True if `first` of the present phase's sequence has held, and `broken` has not held since.
    underway: bool,
    /// Time since which the present phase's lasting condition has held, in simulated seconds.
    since_s: Option<f64>,
    /// The milestones of the present phase that have been begun.
    milestones: Vec<MilestoneMemory>,
    /// True if the present phase has been spoiled.
    spoiled: bool,
}

/// State of a milestone.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
struct MilestoneMemory {
    /// Time since which its condition has held, in simulated seconds.
    since_s: Option<f64>,
    passed: bool,
}

impl PhaseTracker {
    pub fn new(phases: Arc<[Phase]>) -> PhaseTracker {
        PhaseTracker { phases, memory: PhaseMemory::default() }
    }

    pub fn memory(&self) -> &PhaseMemory {
        &self.memory
    }

    /// Returns `true` if a memory can belong to these phases.
    pub fn fits(&self, memory: &PhaseMemory) -> bool {
        memory.reached_s.len() <= self.phases.len()
    }

    /// Restores an earlier [`PhaseTracker::memory`] of the same phases.
    pub fn set_memory(&mut self, memory: PhaseMemory) {
        self.memory = memory;
    }

    /// Evaluates one control step. Returns `true` if it reached a phase.
    pub fn update(&mut self, facts: &Facts) -> bool {
        let memory = &mut self.memory;
        let before = memory.reached_s.len();
        while let Some(phase) = self.phases.get(memory.reached_s.len()) {
            if !memory.is_done(&phase.done, facts) {
                break;
            }
            memory.reached_s.push(facts.time_s);
            memory.underway = false;
            memory.since_s = None;
            memory.milestones.clear();
            memory.spoiled = false;
        }
        memory.reached_s.len() > before
    }

    /// Returns the phases reached up to now, in order, with the time of each.
    pub fn reached(&self) -> impl Iterator<Item = (&Phase, f64)> {
        self.phases.iter().zip(self.memory.reached_s.iter().copied())
    }

    /// Returns the number of phases reached, plus the nearness of the next one.
    pub fn progress(&self, facts: &Facts) -> f64 {
        let reached = self.memory.reached_s.len();
        let next = self.phases.get(reached).map_or(0.0, |phase| (phase.nearness)(facts));
        reached as f64 + f64::from(next)
    }

    /// Returns `true` if the last phase has been reached.
    pub fn complete(&self) -> bool {
        self.memory.reached_s.len() == self.phases.len()
    }
}

impl PhaseMemory {
    /// Returns `true` if the next phase is a sequence whose `first` has held, unbroken.
    pub fn underway(&self) -> bool {
        self.underway
    }

    /// Returns `true` if the next phase has been spoiled.
    pub fn spoiled(&self) -> bool {
        self.spoiled
    }

    /// Returns the time since which the next phase's lasting condition has held, in simulated seconds.
    pub fn since_s(&self) -> Option<f64> {
        self.since_s
    }

    /// Returns the time since which the condition of milestone `index` of the next phase has held, in
    /// simulated seconds, and whether it has been passed.
    pub fn milestone(&self, index: usize) -> (Option<f64>, bool) {
        self.milestones.get(index).map_or((None, false), |memory| (memory.since_s, memory.passed))
    }

    fn is_done(&mut self, done: &Done, facts: &Facts) -> bool {
        match done {
            Done::When(condition) => condition.holds(facts),
            Done::Sequence { first, then, broken } => {
                let breaks = broken.as_ref().is_some_and(|broken| broken.holds(facts));
                self.underway = (self.underway && !breaks) || first.holds(facts);
                self.underway && then.holds(facts)
            }
            Done::Lasting { condition, for_s, at_end } => {
                lasted(&mut self.since_s, condition, *for_s, facts)
                    && at_end.as_ref().is_none_or(|at_end| at_end.holds(facts))
            }
            Done::Milestones(milestones) => {
                self.milestones.resize(milestones.len(), MilestoneMemory::default());
                for (milestone, memory) in milestones.iter().zip(&mut self.milestones) {
                    memory.passed |=
                        lasted(&mut memory.since_s, &milestone.condition, milestone.for_s, facts);
                }
                self.milestones.iter().all(|memory| memory.passed)
            }
            Done::Unless { spoiled, done } => {
                self.spoiled |= spoiled.holds(facts);
                !self.spoiled && self.is_done(done, facts)
            }
        }
    }
}

/// Returns `true` if `condition` has held without a break for `for_s`; `since_s` stores the time since which
/// it has held.
fn lasted(since_s: &mut Option<f64>, condition: &Condition, for_s: f64, facts: &Facts) -> bool {
    *since_s = condition.holds(facts).then(|| since_s.unwrap_or(facts.time_s));
    // Times are sums of control steps; a tolerance of half a step absorbs rounding errors.
    since_s.is_some_and(|since_s| facts.time_s - since_s >= for_s - HALF_STEP_S)
}

const HALF_STEP_S: f64 = 0.5 / tandem_sim::CONTROL_HZ;

#[cfg(test)]
mod tests;
