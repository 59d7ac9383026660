//! The rules of an episode.

use std::time::Duration;

use tandem_tools_spec::Protocol;

use crate::EpisodeError;
use crate::tasks::Task;

/// What a protocol allows for one task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
    pub protocol: Protocol,
    /// The most control steps that one command may ask for.
    pub steps_per_command: u32,
    /// Control steps of an episode, the initial hold included.
    pub episode_steps: u32,
    /// Control steps spent standing still before the policy's first call.
    pub initial_hold_steps: u32,
    /// How long the policy may think; `None` for as long as it likes.
    pub thinking: Option<Duration>,
    /// First and last of the seeds that results are reported on.
    pub seeds: (u32, u32),
}

impl Rules {
    /// The control steps of one command, if it may ask for that many.
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

/// What `protocol` allows for `task`.
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
        let agentic = rules(Protocol::Agentic, handover);
        assert_eq!((agentic.steps_per_command, agentic.episode_steps), (25, 6000));
        assert_eq!((agentic.initial_hold_steps, agentic.seeds), (300, (0, 9)));
        assert_eq!(agentic.thinking, Some(Duration::from_secs(1800)));
        let benchmark = rules(Protocol::Benchmark, handover);
        assert_eq!((benchmark.steps_per_command, benchmark.episode_steps), (50, 1000));
        assert_eq!((benchmark.initial_hold_steps, benchmark.seeds), (0, (1, 100)));
        assert_eq!(benchmark.thinking, None);
    }
}
