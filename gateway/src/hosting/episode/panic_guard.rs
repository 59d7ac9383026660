//! The panic guard: a session in which a panic ends only this episode. Its work is counted in the metrics.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::time::Duration;

use tandem_episodes::Session;
use tandem_tools_spec::{EndReason, ResultReply};

use crate::hosting::HostingError;
use crate::metrics::Metrics;

/// A session that is usable until it panics.
pub struct PanicGuard {
    state: GuardState,
    metrics: EpisodeMetrics,
}

enum GuardState {
    Sound(Box<Session>),
    /// The session has panicked, and its world is no longer used because its state is undefined. The value is
    /// the result, if the recording could be closed.
    Panicked(Option<Box<ResultReply>>),
}

impl PanicGuard {
    /// Guards a new session whose work is counted by `metrics`.
    pub fn new(session: Session, mut metrics: EpisodeMetrics) -> PanicGuard {
        metrics.begin(&session);
        PanicGuard { state: GuardState::Sound(Box::new(session)), metrics }
    }

    /// Guards a restored session that the metrics already include up to its current state.
    pub fn again(session: Session, metrics: EpisodeMetrics) -> PanicGuard {
        PanicGuard { state: GuardState::Sound(Box::new(session)), metrics }
    }

    /// Runs `work` on the session.
    ///
    /// # Errors
    ///
    /// Returns an error if `work` panics. The panic ends the episode and closes its recording. This and every
    /// later call then return [`HostingError::EpisodePanicked`].
    pub fn run<T>(&mut self, work: impl FnOnce(&mut Session) -> T) -> Result<T, HostingError> {
        let GuardState::Sound(session) = &mut self.state else { return Err(HostingError::EpisodePanicked) };
        match catch_unwind(AssertUnwindSafe(|| work(session))) {
            Ok(done) => {
                self.metrics.count(session);
                Ok(done)
            }
            Err(panic) => {
                self.after(panic);
                Err(HostingError::EpisodePanicked)
            }
        }
    }

    /// Returns the reason why the episode takes no more commands, or `None` while it does.
    pub fn ended(&self) -> Option<EndReason> {
        match &self.state {
            GuardState::Sound(session) => session.ended(),
            GuardState::Panicked(_) => Some(EndReason::SimulatorFailed),
        }
    }

    /// Returns the number of executed control steps, or `None` after a panic.
    pub fn env_steps(&self) -> Option<u32> {
        match &self.state {
            GuardState::Sound(session) => Some(session.env_steps()),
            GuardState::Panicked(_) => None,
        }
    }

    /// Returns the policy's thinking time up to its last call, or `None` after a panic.
    pub fn thought(&self) -> Option<Duration> {
        match &self.state {
            GuardState::Sound(session) => Some(session.thought()),
            GuardState::Panicked(_) => None,
        }
    }

    /// Returns the reason why the recording is incomplete, if it is.
    pub fn recording_failed(&self) -> Option<&str> {
        match &self.state {
            GuardState::Sound(session) => session.recording_failed(),
            GuardState::Panicked(result) => result.as_ref()?.recording_failed.as_deref(),
        }
    }

    /// Ends the episode and closes its recording.
    pub fn close(mut self) -> Result<ResultReply, HostingError> {
        match self.state {
            GuardState::Sound(session) => {
                let result = closed(|| session.close()).map_err(|panic| {
                    tracing::error!(panic = text(&*panic), "not closed");
                    HostingError::EpisodePanicked
                });
                let reason = result.as_ref().map_or(EndReason::SimulatorFailed, |result| result.ended);
                self.metrics.end(reason);
                result
            }
            GuardState::Panicked(result) => result.map(|result| *result).ok_or(HostingError::EpisodePanicked),
        }
    }

    fn after(&mut self, panic: Box<dyn Any + Send>) {
        tracing::error!(panic = text(&*panic), "the simulator panicked; this episode ends");
        self.metrics.end(EndReason::SimulatorFailed);
        let GuardState::Sound(session) = std::mem::replace(&mut self.state, GuardState::Panicked(None))
        else {
            return;
        };
        // The broken world may panic again during the closing. The part of the recording flushed by then
        // stays readable.
        let why = format!("by a panic: {}", text(&*panic));
        match closed(|| session.close_failed(why)) {
            Ok(result) => self.state = GuardState::Panicked(Some(Box::new(result))),
            Err(panic) => tracing::error!(panic = text(&*panic), "not closed"),
        }
    }
}

/// The part of one episode that the metrics already include.
#[derive(Debug)]
pub struct EpisodeMetrics {
    metrics: Arc<Metrics>,
    control_steps: u64,
    physics: Duration,
    ended: bool,
}

impl EpisodeMetrics {
    /// Starts counting an episode that has not begun.
    pub fn new(metrics: Arc<Metrics>) -> EpisodeMetrics {
        EpisodeMetrics { metrics, control_steps: 0, physics: Duration::ZERO, ended: false }
    }

    /// Continues counting an episode that the metrics already include up to the state of `session`.
    pub fn again(metrics: Arc<Metrics>, session: &Session) -> EpisodeMetrics {
        EpisodeMetrics {
            metrics,
            control_steps: session.present().control_step,
            physics: session.physics(),
            ended: session.ended().is_some(),
        }
    }

    /// Counts the start of the episode and its initial hold.
    pub fn begin(&mut self, session: &Session) {
        self.metrics.episode_started();
        self.count(session);
    }

    /// Counts the session's work since the last count.
    pub fn count(&mut self, session: &Session) {
        let (control_steps, physics) = (session.present().control_step, session.physics());
        let since = control_steps.saturating_sub(self.control_steps);
        self.metrics.simulated(since, physics.saturating_sub(self.physics));
        (self.control_steps, self.physics) = (control_steps, physics);
        if let Some(reason) = session.ended() {
            self.end(reason);
        }
    }

    /// Counts the end of the episode, once.
    pub fn end(&mut self, reason: EndReason) {
        if !self.ended {
            self.ended = true;
            self.metrics.episode_ended(reason);
        }
    }
}

fn closed(close: impl FnOnce() -> ResultReply) -> Result<ResultReply, Box<dyn Any + Send>> {
    catch_unwind(AssertUnwindSafe(close))
}

fn text(panic: &(dyn Any + Send)) -> &str {
    let owned = panic.downcast_ref::<String>().map(String::as_str);
    owned.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no text")
}
