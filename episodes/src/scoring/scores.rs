//! The score of one episode: grasps, facts and phases, step by step. An episode under way and its recording are scored alike.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectFile, RobotModel, SimError, Step};

use super::facts_tracker::{FactsTracker, ObjectMemory};
use super::phases::{PhaseMemory, PhaseTracker};
use super::{Facts, Phase};

/// How far an episode has come.
#[derive(Clone, Debug)]
pub struct Scores {
    tracker: FactsTracker,
    phases: PhaseTracker,
}

/// What [`Scores`] remember between control steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScoreMemory {
    objects: Vec<ObjectMemory>,
    phases: PhaseMemory,
}

/// What one control step shows.
pub struct StepScore {
    pub facts: Facts,
    /// Whether it reached a phase.
    pub reached: bool,
}

impl Scores {
    /// Begins to score `phases`, which may ask for `objects`, given by name and file, and for robots of this model, with the
    /// state before the first control step.
    pub fn new<'a>(
        phases: &'static [Phase],
        objects: impl Iterator<Item = (&'a str, ObjectFile)>,
        robot: &Arc<RobotModel>,
        start: &Step,
    ) -> Result<Scores, SimError> {
        Ok(Scores { tracker: FactsTracker::new(objects, robot, start)?, phases: PhaseTracker::new(phases) })
    }

    /// Whether a step has all objects that phases may ask for.
    pub fn sees(&self, step: &Step) -> bool {
        self.tracker.memory().iter().all(|object| step.object(object.name()).is_some())
    }

    /// Looks at the control step that follows the last one.
    pub fn update(&mut self, step: &Step) -> StepScore {
        self.tracker.update(step);
        let facts = self.tracker.facts(step);
        let reached = self.phases.update(&facts);
        StepScore { facts, reached }
    }

    /// The facts after `step`, the last one that was looked at.
    pub fn facts(&self, step: &Step) -> Facts {
        self.tracker.facts(step)
    }

    /// The phases reached so far, in order, with the simulated time of each.
    pub fn reached(&self) -> impl Iterator<Item = (&'static Phase, f64)> {
        self.phases.reached()
    }

    /// The phases reached, and how near the next one is, after `step`, the last one that was looked at.
    pub fn progress(&self, step: &Step) -> f64 {
        self.phases.progress(&self.facts(step))
    }

    /// Returns the memory of the next phase.
    pub fn next_phase(&self) -> &PhaseMemory {
        self.phases.memory()
    }

    /// Whether the last phase has been reached.
    pub fn complete(&self) -> bool {
        self.phases.complete()
    }

    pub fn memory(&self) -> ScoreMemory {
        ScoreMemory { objects: self.tracker.memory().to_vec(), phases: self.phases.memory().clone() }
    }

    /// Goes back to an earlier [`Scores::memory`] of the same phases and objects. Returns false, and goes nowhere, where it is of others.
    #[must_use]
    pub fn set_memory(&mut self, memory: ScoreMemory) -> bool {
        if !self.tracker.fits(&memory.objects) || !self.phases.fits(&memory.phases) {
            return false;
        }
        self.tracker.set_memory(memory.objects);
        self.phases.set_memory(memory.phases);
        true
    }
}
