//! The rules of an episode and what is left of them: steps, and the time that the policy may think.

use std::time::{Duration, Instant};

use tandem_tools_spec::Protocol;

use crate::tasks::Task;

/// What a protocol allows for one task.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rules {
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

/// What `protocol` allows for `task`.
pub fn rules(protocol: Protocol, task: &Task) -> Rules {
    match protocol {
        Protocol::Agentic => Rules {
            steps_per_command: 25,
            episode_steps: 6000,
            initial_hold_steps: 300,
            thinking: Some(Duration::from_secs(1800)),
            seeds: (0, 9),
        },
        Protocol::Benchmark => Rules {
            steps_per_command: 50,
            episode_steps: task.benchmark_steps,
            initial_hold_steps: 0,
            thinking: None,
            seeds: (1, 100),
        },
    }
}

/// Time since some fixed moment. Episodes use [`monotonic`]; tests turn the hands themselves.
pub type Clock = Box<dyn Fn() -> Duration + Send>;

/// The machine's monotonic clock.
pub fn monotonic() -> Clock {
    let start = Instant::now();
    Box::new(move || start.elapsed())
}

/// The policy's wall clock: it runs from the end of a call to the beginning of the next, never while we compute.
pub struct ThinkingClock {
    now: Clock,
    allowed: Option<Duration>,
    spent: Duration,
    /// When the policy began to think; `None` while a call is being answered.
    since: Option<Duration>,
}

impl ThinkingClock {
    /// Stands still until [`ThinkingClock::resume`].
    pub fn new(allowed: Option<Duration>, now: Clock) -> ThinkingClock {
        ThinkingClock { now, allowed, spent: Duration::ZERO, since: None }
    }

    /// A call has arrived.
    pub fn pause(&mut self) {
        if let Some(since) = self.since.take() {
            self.spent += (self.now)().saturating_sub(since);
        }
    }

    /// The reply is ready.
    pub fn resume(&mut self) {
        self.since.get_or_insert((self.now)());
    }

    /// What the policy has left; `None` for as long as it likes.
    pub fn left(&self) -> Option<Duration> {
        let thinking = self.since.map_or(Duration::ZERO, |since| (self.now)().saturating_sub(since));
        self.allowed.map(|allowed| allowed.saturating_sub(self.spent + thinking))
    }

    pub fn exhausted(&self) -> bool {
        self.left() == Some(Duration::ZERO)
    }

    /// How long the policy has thought up to the last [`ThinkingClock::pause`].
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// Goes back to an earlier [`ThinkingClock::spent`], as when an episode is taken up again from a snapshot.
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
