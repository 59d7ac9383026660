//! Nobody: robots hold still. What a task lets this player reach is no achievement.

use tandem_tools_spec::Wait;

use super::{Episode, Player, PlayerError};
use crate::tasks::Task;

/// The agentic protocol allows no more.
const STEPS_PER_COMMAND: u32 = 25;

/// Waits for as long as the benchmark protocol lasts.
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
