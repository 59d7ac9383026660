//! Rules for operators, from an episode's specification.

use std::time::Duration;

use tandem_episodes::{EpisodeSpec, stress::Silence};

/// Rules for the operators of an episode.
#[derive(Debug, Clone, Copy, Default)]
pub struct TeamRules {
    /// Limit of each operator's thinking time; `None` for no limit.
    pub thinking_limit: Option<Duration>,
    /// Message loss between operators under stress.
    pub silence: Option<Silence>,
}

impl TeamRules {
    /// Returns the rules of an episode.
    pub fn of(spec: &EpisodeSpec) -> TeamRules {
        let robots = spec.task.robots.len();
        let silence = spec.stress.and_then(|stress| stress.silence(spec.world_seed(), robots));
        TeamRules { thinking_limit: spec.rules().thinking, silence }
    }
}
