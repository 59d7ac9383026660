//! A session that a panic ends, and nothing but it.

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::time::Duration;

use tandem_episodes::Session;
use tandem_tools_spec::{EndReason, ResultReply};

use super::{HostingError, tally::Tally};

/// A session, until it has panicked.
pub struct Guarded {
    state: State,
    tally: Tally,
}

enum State {
    Sound(Box<Session>),
    /// After a panic the world may be anything, and nobody looks at it again. The result is of what could be closed.
    Panicked(Option<ResultReply>),
}

impl Guarded {
    /// A session whose doings are counted by `tally`.
    pub fn new(session: Session, mut tally: Tally) -> Guarded {
        tally.begin(&session);
        Guarded { state: State::Sound(Box::new(session)), tally }
    }

    /// Lets the session do `work`. A panic ends the episode: its recording is closed, and this and every later work is refused.
    pub fn run<T>(&mut self, work: impl FnOnce(&mut Session) -> T) -> Result<T, HostingError> {
        let State::Sound(session) = &mut self.state else { return Err(HostingError::EpisodePanicked) };
        match catch_unwind(AssertUnwindSafe(|| work(session))) {
            Ok(done) => {
                self.tally.count(session);
                Ok(done)
            }
            Err(panic) => {
                self.after(panic);
                Err(HostingError::EpisodePanicked)
            }
        }
    }

    /// Whether the episode takes no more commands.
    pub fn ended(&self) -> bool {
        match &self.state {
            State::Sound(session) => session.ended().is_some(),
            State::Panicked(_) => true,
        }
    }

    /// How long the policy has thought, up to its last call; nothing that is known after a panic.
    pub fn thought(&self) -> Duration {
        match &self.state {
            State::Sound(session) => session.thought(),
            State::Panicked(_) => Duration::ZERO,
        }
    }

    /// Why the recording is not complete, if it is not.
    pub fn recording_failed(&self) -> Option<&str> {
        match &self.state {
            State::Sound(session) => session.recording_failed(),
            State::Panicked(result) => result.as_ref()?.recording_failed.as_deref(),
        }
    }

    /// Ends the episode and closes its recording.
    pub fn close(mut self) -> Result<ResultReply, HostingError> {
        match self.state {
            State::Sound(session) => {
                let result = closed(|| session.close()).map_err(|panic| {
                    tracing::error!(panic = text(&*panic), "not closed");
                    HostingError::EpisodePanicked
                });
                let reason = result.as_ref().map_or(EndReason::SimulatorFailed, |result| result.ended);
                self.tally.end(reason);
                result
            }
            State::Panicked(result) => result.ok_or(HostingError::EpisodePanicked),
        }
    }

    fn after(&mut self, panic: Box<dyn Any + Send>) {
        tracing::error!(panic = text(&*panic), "the simulator panicked; this episode ends");
        self.tally.end(EndReason::SimulatorFailed);
        let State::Sound(session) = std::mem::replace(&mut self.state, State::Panicked(None)) else { return };
        // The broken world may panic once more under way; what is flushed by then can be read nevertheless.
        match closed(|| session.close_failed()) {
            Ok(result) => self.state = State::Panicked(Some(result)),
            Err(panic) => tracing::error!(panic = text(&*panic), "not closed"),
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
