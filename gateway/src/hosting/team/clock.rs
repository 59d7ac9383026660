//! Clock of one operator. It runs while the operator thinks and the episode may have to wait for the
//! operator.
//!
//! The clock starts with the operator's first request. It is paused while the operator's command is pending
//! or being executed, and once nobody waits for the operator any more. The protocol's limit applies to each
//! operator separately. For an operator in real time, which sends one command per control step, only time
//! beyond that step counts as thinking.

use std::time::{Duration, Instant};

/// Thinking time of an operator.
#[derive(Debug, Default)]
pub struct OperatorClock {
    spent: Duration,
    /// Time at which the clock last started or will start; `None` while it is paused.
    since: Option<Instant>,
    /// Time after a command that is not charged as thinking.
    pace: Duration,
}

impl OperatorClock {
    /// Starts the clock after the pacing time, unless it runs already.
    pub fn run(&mut self) {
        let pace = self.pace;
        self.since.get_or_insert_with(|| Instant::now() + pace);
    }

    /// Sets the pacing time after a command, which is not charged: one control step in real time, otherwise
    /// 0.
    pub fn set_pace(&mut self, pace: Duration) {
        self.pace = pace;
    }

    /// Stops the clock.
    pub fn stop(&mut self) {
        self.spent = self.thought();
        self.since = None;
    }

    /// Returns the thinking time up to the last pause.
    pub fn spent(&self) -> Duration {
        self.spent
    }

    /// Returns the thinking time up to now.
    pub fn thought(&self) -> Duration {
        self.spent + self.running().unwrap_or_default()
    }

    /// Returns the time since the clock last started; `None` while it is paused.
    pub fn running(&self) -> Option<Duration> {
        self.since.map(|since| since.elapsed())
    }

    /// Adds thinking time that an earlier process has measured.
    pub fn add(&mut self, earlier: Duration) {
        self.spent += earlier;
    }
}

/// Converts a duration to seconds, rounded to milliseconds, for replies.
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
