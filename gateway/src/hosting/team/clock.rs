//! The clock of one operator: it runs while the operator thinks and the episode may have to wait for it.
//!
//! It begins with the operator's first request. It is paused while the operator's command waits or is
//! executed, and once nobody waits for the operator any more. Each operator has the whole limit of the
//! protocol. An operator in real time commands once in a control step, and thinks only beyond that step.

use std::time::{Duration, Instant};

/// Thinking time of an operator.
#[derive(Debug, Default)]
pub struct OperatorClock {
    spent: Duration,
    /// Moment when it began to run, or will begin; `None` while it is paused.
    since: Option<Instant>,
    /// Time after a command that counts as pacing.
    pace: Duration,
}

impl OperatorClock {
    /// Starts the clock unless it runs already. For an operator in real time it starts after the pacing.
    pub fn run(&mut self) {
        let pace = self.pace;
        self.since.get_or_insert_with(|| Instant::now() + pace);
    }

    /// Sets the time after a command that counts as pacing: a control step in real time, and otherwise 0.
    pub fn set_pace(&mut self, pace: Duration) {
        self.pace = pace;
    }

    /// Stands from now on.
    pub fn stop(&mut self) {
        self.spent = self.thought();
        self.since = None;
    }

    /// Returns the running time up to the last pause.
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// Returns the time for which it has run.
    pub fn thought(&self) -> Duration {
        self.spent + self.running().unwrap_or_default()
    }

    /// Returns the time since it began to run; `None` while it is paused.
    pub fn running(&self) -> Option<Duration> {
        self.since.map(|since| since.elapsed())
    }

    /// Adds the time of an earlier process.
    pub fn add(&mut self, earlier: Duration) {
        self.spent += earlier;
    }
}

/// Returns seconds to the millisecond, as replies have them.
pub(super) fn to_ms(time: Duration) -> f64 {
    (time.as_secs_f64() * 1e3).round() / 1e3
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clock_counts_the_time_for_which_it_runs() {
        let mut clock = OperatorClock::default();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(clock.thought(), Duration::ZERO, "it has not begun");
        clock.run();
        std::thread::sleep(Duration::from_millis(2));
        assert!(clock.thought() >= Duration::from_millis(2));
        assert_eq!(clock.spent(), Duration::ZERO);
        clock.stop();
        let spent = clock.spent();
        std::thread::sleep(Duration::from_millis(2));
        assert!(spent > Duration::ZERO && clock.thought() == spent, "it stands");
        clock.add(Duration::from_secs(1));
        assert_eq!(clock.thought(), spent + Duration::from_secs(1));
    }

    #[test]
    fn pacing_is_not_thinking() {
        let mut clock = OperatorClock::default();
        clock.set_pace(Duration::from_secs(60));
        clock.run();
        std::thread::sleep(Duration::from_millis(2));
        assert_eq!(clock.thought(), Duration::ZERO);
        clock.stop();
        clock.set_pace(Duration::ZERO);
        clock.run();
        std::thread::sleep(Duration::from_millis(2));
        assert!(clock.thought() >= Duration::from_millis(2));
    }
}
