//! The rules of an episode.

use std::time::Duration;

use tandem_tools_spec::Protocol;

use crate::EpisodeError;
use crate::tasks::Task;

/// Limits of a protocol for one task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    pub protocol: Protocol,
    /// Maximum number of control steps in one command.
    pub steps_per_command: u32,
    /// Control steps of an episode, including the initial hold.
    pub episode_steps: u32,
    /// Control steps for which robots stand still before the policy's first call.
    pub initial_hold_steps: u32,
    /// Limit of the policy's thinking time; `None` for no limit.
    pub thinking: Option<Duration>,
    /// First and last of the seeds on which results are reported.
    pub seeds: (u32, u32),
}

impl Rules {
    /// Checks the number of control steps that a command asks for.
    ///
    /// # Errors
    ///
    /// [`EpisodeError::TooManySteps`] outside the protocol's range.
    pub fn steps(&self, asked: u32) -> Result<u32, EpisodeError> {
        match (1..=self.steps_per_command).contains(&asked) {
            true => Ok(asked),
            false => Err(EpisodeError::TooManySteps {
                asked,
                most: self.steps_per_command,
                protocol: self.protocol.name(),
            }),
        }
    }
}

/// Returns the rules of `protocol` for `task`.
pub fn rules(protocol: Protocol, task: &Task) -> Rules {
    match protocol {
        Protocol::Agentic => Rules {
            protocol,
            steps_per_command: 25,
            episode_steps: task.agentic_steps,
            initial_hold_steps: 300,
            thinking: Some(Duration::from_secs(task.thinking_s.into())),
            seeds: (0, 9),
        },
        Protocol::Benchmark => Rules {
            protocol,
            steps_per_command: 50,
            episode_steps: task.benchmark_steps,
            initial_hold_steps: 0,
            thinking: None,
            seeds: (1, 100),
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks;

    #[test]
    fn budgets_are_the_benchmarks() {
        let handover = tasks::find("handover").unwrap();
        let agentic = rules(Protocol::Agentic, &handover);
        assert_eq!((agentic.steps_per_command, agentic.episode_steps), (25, 6000));
        assert_eq!((agentic.initial_hold_steps, agentic.seeds), (300, (0, 9)));
        assert_eq!(agentic.thinking, Some(Duration::from_secs(1800)));
        let benchmark = rules(Protocol::Benchmark, &handover);
        assert_eq!((benchmark.steps_per_command, benchmark.episode_steps), (50, 1000));
        assert_eq!((benchmark.initial_hold_steps, benchmark.seeds), (0, (1, 100)));
        assert_eq!(benchmark.thinking, None);
    }
}
