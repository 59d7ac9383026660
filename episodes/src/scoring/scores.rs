//! Score of one episode: grasps, facts and phases, step by step. A live episode and its recording are scored
//! in the same way.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use tandem_sim::{ObjectFile, RobotModel, SimError, Step};

use super::facts_tracker::{FactsTracker, ObjectMemory};
use super::phases::{PhaseMemory, PhaseTracker};
use super::{Facts, Phase};

/// Scoring state of an episode.
#[derive(Clone, Debug)]
pub struct Scores {
    tracker: FactsTracker,
    phases: PhaseTracker,
}

/// Memory of [`Scores`] between control steps.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ScoreMemory {
    objects: Vec<ObjectMemory>,
    phases: PhaseMemory,
}

/// Score of one control step.
pub struct StepScore {
    pub facts: Facts,
    /// True if the step reached a phase.
    pub reached: bool,
}

impl Scores {
    /// Begins to score `phases` with the state before the first control step. Their conditions may refer to
    /// `objects`, given by name and file, and to robots of this model.
    pub fn new<'a>(
        phases: Arc<[Phase]>,
        objects: impl Iterator<Item = (&'a str, ObjectFile)>,
        robot: &Arc<RobotModel>,
        start: &Step,
    ) -> Result<Scores, SimError> {
        Ok(Scores { tracker: FactsTracker::new(objects, robot, start)?, phases: PhaseTracker::new(phases) })
    }

    /// Returns `true` if a step has all objects that the phases' conditions may refer to.
    pub fn sees(&self, step: &Step) -> bool {
        self.tracker.memory().iter().all(|object| step.object(object.name()).is_some())
    }

    /// Scores the control step that follows the last one.
    pub fn update(&mut self, step: &Step) -> StepScore {
        self.tracker.update(step);
        let facts = self.tracker.facts(step);
        let reached = self.phases.update(&facts);
        StepScore { facts, reached }
    }

    /// Returns the facts after `step`, which must be the last scored step.
    pub fn facts(&self, step: &Step) -> Facts {
        self.tracker.facts(step)
    }

    /// Returns the phases reached up to now, in order, with the simulated time of each.
    pub fn reached(&self) -> impl Iterator<Item = (&Phase, f64)> {
        self.phases.reached()
    }

    /// Returns the number of phases reached, plus the nearness of the next one. `step` must be the last
    /// scored step.
    pub fn progress(&self, step: &Step) -> f64 {
        self.phases.progress(&self.facts(step))
    }

    /// Returns the memory of the next phase.
    pub fn next_phase(&self) -> &PhaseMemory {
        self.phases.memory()
    }

    /// Returns `true` if the last phase has been reached.
    pub fn complete(&self) -> bool {
        self.phases.complete()
    }

    pub fn memory(&self) -> ScoreMemory {
        ScoreMemory { objects: self.tracker.memory().to_vec(), phases: self.phases.memory().clone() }
    }

    /// Restores an earlier [`Scores::memory`] of the same phases and objects. A memory of other phases or
    /// objects is left unused, and the function returns `false`.
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
