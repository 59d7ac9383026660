//! The policy's thinking time: the wall clock runs between its calls, and never during computation.

use std::time::{Duration, Instant};

/// A function that returns the time since a fixed moment. Episodes use [`monotonic`]; tests set the time
/// themselves.
pub type Clock = Box<dyn Fn() -> Duration + Send>;

/// Returns the machine's monotonic clock.
pub fn monotonic() -> Clock {
    let start = Instant::now();
    Box::new(move || start.elapsed())
}

/// The policy's wall clock: it runs from the end of a call to the beginning of the next, and never during
/// computation.
pub struct ThinkingClock {
    now: Clock,
    allowed: Option<Duration>,
    spent: Duration,
    /// Moment when the policy began to think; `None` during a call.
    since: Option<Duration>,
}

impl ThinkingClock {
    /// Returns a clock that is paused until [`ThinkingClock::resume`].
    pub fn new(allowed: Option<Duration>, now: Clock) -> ThinkingClock {
        ThinkingClock { now, allowed, spent: Duration::ZERO, since: None }
    }

    /// Pauses the clock when a call arrives.
    pub fn pause(&mut self) {
        if let Some(since) = self.since.take() {
            self.spent += (self.now)().saturating_sub(since);
        }
    }

    /// Resumes the clock when the reply is ready.
    pub fn resume(&mut self) {
        self.since.get_or_insert((self.now)());
    }

    /// Returns the remaining thinking time; `None` without a limit.
    pub fn left(&self) -> Option<Duration> {
        let allowed = self.allowed?;
        Some(allowed.saturating_sub(self.spent + self.thinking()))
    }

    /// Returns the thinking time since the last reply.
    pub fn thinking(&self) -> Duration {
        self.since.map_or(Duration::ZERO, |since| (self.now)().saturating_sub(since))
    }

    pub fn exhausted(&self) -> bool {
        self.left() == Some(Duration::ZERO)
    }

    /// Returns the thinking time up to the last [`ThinkingClock::pause`].
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// Restores an earlier [`ThinkingClock::spent`], for example when an episode resumes from a checkpoint.
    pub fn set_spent(&mut self, spent: Duration) {
        self.spent = spent;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Arc,
        atomic::{AtomicU64, Ordering::Relaxed},
    };

    use super::*;

    #[test]
    fn only_the_time_between_calls_counts() {
        let hands_ms = Arc::new(AtomicU64::new(0));
        let pass = |ms: u64| {
            hands_ms.fetch_add(ms, Relaxed);
        };
        let read = hands_ms.clone();
        let now: Clock = Box::new(move || Duration::from_millis(read.load(Relaxed)));
        let mut clock = ThinkingClock::new(Some(Duration::from_millis(100)), now);
        let left_ms = |clock: &ThinkingClock| clock.left().unwrap().as_millis();

        pass(1000); // the world is built
        assert_eq!(left_ms(&clock), 100);
        clock.resume();
        pass(40); // the policy thinks
        assert_eq!(left_ms(&clock), 60);
        clock.pause();
        pass(1000); // physics runs
        assert_eq!(left_ms(&clock), 60);
        clock.resume();
        pass(59);
        assert!(!clock.exhausted());
        pass(1);
        assert!(clock.exhausted());
        pass(1000);
        clock.pause();
        assert_eq!((left_ms(&clock), clock.exhausted()), (0, true));
    }

    #[test]
    fn without_a_limit_the_clock_never_runs_out() {
        let mut clock = ThinkingClock::new(None, Box::new(|| Duration::MAX));
        clock.resume();
        assert_eq!((clock.left(), clock.exhausted()), (None, false));
    }
}
