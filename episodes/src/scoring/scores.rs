//! The score of one episode: grasps, facts and phases, step by step. An episode under way and its recording are scored alike.

use serde::{Deserialize, Serialize};
use tandem_sim::Step;

use super::phases::{PhaseProgress, PhaseTracker};
use super::scorekeeper::Scorekeeper;
use super::{Facts, Phase};

/// How far an episode has come.
#[derive(Clone, Debug)]
pub struct Scores {
    keeper: Scorekeeper,
    phases: PhaseTracker,
}

/// What [`Scores`] remember between control steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Progress {
    keeper: Scorekeeper,
    phases: PhaseProgress,
}

impl Scores {
    /// Begins to score `phases`, which may ask for the objects called `names`, with the state before the first control step.
    pub fn new<'a>(phases: &'static [Phase], names: impl Iterator<Item = &'a str>, start: &Step) -> Scores {
        Scores { keeper: Scorekeeper::new(names, start), phases: PhaseTracker::new(phases) }
    }

    /// Looks at the control step that follows the last one; true if it reached a phase.
    pub fn update(&mut self, step: &Step) -> bool {
        self.keeper.update(step);
        self.phases.update(&self.keeper.facts(step))
    }

    /// The facts after `step`, the last one that was looked at.
    pub fn facts(&self, step: &Step) -> Facts {
        self.keeper.facts(step)
    }

    /// The phases reached so far, in order, with the simulated time of each.
    pub fn reached(&self) -> impl Iterator<Item = (&'static Phase, f64)> {
        self.phases.reached()
    }

    /// Whether the present phase is a sequence that has begun.
    pub fn underway(&self) -> bool {
        self.phases.underway()
    }

    /// Whether the last phase has been reached.
    pub fn complete(&self) -> bool {
        self.phases.complete()
    }

    pub fn progress(&self) -> Progress {
        Progress { keeper: self.keeper.clone(), phases: self.phases.progress().clone() }
    }

    /// Goes back to an earlier [`Scores::progress`] of the same phases and objects.
    pub fn set_progress(&mut self, progress: Progress) {
        self.keeper = progress.keeper;
        self.phases.set_progress(progress.phases);
    }
}
