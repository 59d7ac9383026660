//! When the simulator fails: the world goes back to the last good step, and that is kept for a report, with what the robots were told
//! next.

use tandem_sim::dynamics::Diverged;
use tandem_sim::{RobotCommand, SimError, Snapshot, World};
use tandem_tools_spec::EndReason;

use super::{Checkpoint, FailedStep, Session, monotonic};
use crate::EpisodeError;
use crate::commands::MotionState;

/// The file beside the recording: a [`Checkpoint`] of the last good step, with its [`FailedStep`].
pub const FAILED_STEP_FILE: &str = "failed_step.checkpoint";
/// Control steps after which the world is kept anew: at most so many are simulated again.
const KEPT_STEPS: usize = 50;

/// The world as it was a while ago, and what it has been told since. It costs less than to keep it at every step.
#[derive(Default)]
pub struct Rewind {
    kept: Option<Snapshot>,
    since: Vec<Vec<RobotCommand>>,
}

impl Rewind {
    pub fn before_step(&mut self, world: &World) {
        if self.kept.is_none() || self.since.len() >= KEPT_STEPS {
            self.kept = world.snapshot().ok();
            self.since.clear();
        }
    }

    /// The world is another one's from here on.
    pub fn forget(&mut self) {
        *self = Rewind::default();
    }

    /// The world has made a good step.
    pub fn stepped(&mut self, commands: Vec<RobotCommand>) {
        self.since.push(commands);
    }

    /// Takes the world back to its last good step.
    fn back(&self, world: &mut World) -> Result<(), SimError> {
        if let Some(kept) = &self.kept {
            world.restore(kept)?;
        }
        for commands in &self.since {
            world.control_step(commands)?;
        }
        Ok(())
    }
}

impl Session {
    /// Physics has diverged: the episode ends as it was before this step, in which robots were told `commands`; `motions` are those from
    /// before it.
    pub(super) fn fail(
        &mut self,
        diverged: Diverged,
        commands: Vec<RobotCommand>,
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
            checkpoint.failed = Some(FailedStep { failure: failure.clone(), commands });
            checkpoint.to_bytes()
        });
        if let Some(files) = &mut self.files {
            files.failed_step(checkpoint);
        }
        self.simulator_failure = Some(failure);
        self.ended = Some(EndReason::SimulatorFailed);
        EpisodeError::Diverged { step, source: diverged }
    }

    /// Makes the step again in which the simulator failed; `None` if it succeeds now.
    pub fn fail_again(
        checkpoint: &Checkpoint,
        failed: &FailedStep,
    ) -> Result<Option<Diverged>, EpisodeError> {
        let mut session = Session::build(checkpoint.spec(), monotonic())?;
        session.resume(checkpoint)?;
        Ok(session.world.control_step(&failed.commands).err())
    }
}
