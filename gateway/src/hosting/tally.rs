//! What the metrics are told of one episode.

use std::{sync::Arc, time::Duration};

use tandem_episodes::Session;
use tandem_tools_spec::EndReason;

use crate::metrics::Metrics;

/// How far an episode has been counted.
#[derive(Debug)]
pub struct Tally {
    metrics: Arc<Metrics>,
    control_steps: u64,
    physics: Duration,
    ended: bool,
}

impl Tally {
    /// Of an episode that has not begun.
    pub fn new(metrics: Arc<Metrics>) -> Tally {
        Tally { metrics, control_steps: 0, physics: Duration::ZERO, ended: false }
    }

    /// The episode has begun, and may have held still for a while.
    pub fn begin(&mut self, session: &Session) {
        self.metrics.episode_started();
        self.count(session);
    }

    /// Counts what the session has done since it was last counted.
    pub fn count(&mut self, session: &Session) {
        let (control_steps, physics) = (session.present().control_step, session.physics());
        let since = control_steps.saturating_sub(self.control_steps);
        self.metrics.simulated(since, physics.saturating_sub(self.physics));
        (self.control_steps, self.physics) = (control_steps, physics);
        if let Some(reason) = session.ended() {
            self.end(reason);
        }
    }

    /// The episode has ended, which counts once.
    pub fn end(&mut self, reason: EndReason) {
        if !self.ended {
            self.ended = true;
            self.metrics.episode_ended(reason);
        }
    }
}
