//! A player whose robots hold still. A phase that it reaches is no achievement.

use tandem_tools_spec::Wait;

use super::{Episode, Player, PlayerError};
use crate::tasks::Task;

/// Control steps of one command, the most that the agentic protocol allows.
const STEPS_PER_COMMAND: u32 = 25;

/// A player that waits for as long as the benchmark protocol lasts.
pub struct Idle {
    commands: u32,
}

impl Idle {
    pub fn new(task: &Task) -> Idle {
        Idle { commands: task.benchmark_steps.div_ceil(STEPS_PER_COMMAND) }
    }
}

impl Player for Idle {
    fn play(&mut self, episode: &mut dyn Episode) -> Result<(), PlayerError> {
        for _ in 0..self.commands {
            episode.call(Wait { steps: STEPS_PER_COMMAND }.into())?;
        }
        Ok(())
    }
}
