//! Simulator failures: the world goes back to its last good step. A checkpoint of that step is saved for
//! a report, with the robots' next commands.

use tandem_sim::dynamics::Diverged;
use tandem_sim::{SimError, Snapshot, World};
use tandem_tools_spec::EndReason;

use super::{Checkpoint, FailedStep, Session, monotonic};
use crate::EpisodeError;
use crate::commands::{Executed, MotionState};

/// Name of the file beside the recording: a [`Checkpoint`] of the last good step, with its [`FailedStep`].
pub const FAILED_STEP_FILE: &str = "failed_step.checkpoint";
/// Control steps between snapshots of the world, and so the maximum number of steps to simulate again.
const KEPT_STEPS: usize = 50;

/// An earlier snapshot of the world and the commands since then. This costs less than a snapshot at every
/// step.
#[derive(Default)]
pub struct Rewind {
    kept: Option<Snapshot>,
    since: Vec<Executed>,
}

impl Rewind {
    pub fn before_step(&mut self, world: &World) {
        if self.kept.is_none() || self.since.len() >= KEPT_STEPS {
            self.kept = world.snapshot().ok();
            self.since.clear();
        }
    }

    /// Drops the snapshot when the world is replaced.
    pub fn forget(&mut self) {
        *self = Rewind::default();
    }

    /// Records the commands of a good step.
    pub fn stepped(&mut self, executed: Executed) {
        self.since.push(executed);
    }

    /// Restores the world to its last good step.
    fn back(&self, world: &mut World) -> Result<(), SimError> {
        if let Some(kept) = &self.kept {
            world.restore(kept)?;
        }
        for executed in &self.since {
            executed.step(world)?;
        }
        Ok(())
    }
}

impl Session {
    /// Handles a divergence of physics: the episode ends in the state before this step, in which the robots
    /// had to execute `executed`. `motions` are from before the step.
    pub(super) fn fail(
        &mut self,
        diverged: Diverged,
        executed: Executed,
        motions: Vec<MotionState>,
    ) -> EpisodeError {
        let step = u64::from(self.env_steps()) + 1;
        let failure = format!("in step {step}, {diverged}");
        for (motion, state) in self.motions.iter_mut().zip(motions) {
            motion.set_state(state);
        }
        let rewound = self.rewind.back(&mut self.world).map_err(EpisodeError::from);
        let checkpoint = rewound.and_then(|()| {
            let mut checkpoint = self.checkpoint()?;
            checkpoint.failed = Some(FailedStep { failure: failure.clone(), executed });
            checkpoint.to_bytes()
        });
        if let Some(files) = &mut self.files {
            files.failed_step(checkpoint);
        }
        self.simulator_failure = Some(failure);
        self.ended = Some(EndReason::SimulatorFailed);
        EpisodeError::Diverged { step, source: diverged }
    }

    /// Repeats the step in which the simulator failed; `None` if it succeeds now.
    pub fn fail_again(
        checkpoint: &Checkpoint,
        failed: &FailedStep,
    ) -> Result<Option<Diverged>, EpisodeError> {
        let mut session = Session::build(checkpoint.spec(), monotonic())?;
        session.resume(checkpoint)?;
        Ok(failed.executed.step(&mut session.world).err())
    }
}
