//! A clock that is set during a replay, and runs normally afterwards.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use crate::session::Clock;

/// Setter of a clock, which is stopped until [`SetHands::go`].
#[derive(Clone, Default)]
pub struct SetHands {
    shown_ns: Arc<AtomicU64>,
    /// Set once the clock runs.
    goes: Arc<OnceLock<()>>,
}

impl SetHands {
    /// Returns the clock controlled by this setter. Once it runs, it advances like `running`.
    pub fn clock(&self, running: Clock) -> Clock {
        let hands = self.clone();
        let since = OnceLock::new();
        Box::new(move || {
            let shown = Duration::from_nanos(hands.shown_ns.load(Relaxed));
            match hands.goes.get() {
                None => shown,
                Some(()) => shown + running().saturating_sub(*since.get_or_init(&running)),
            }
        })
    }

    /// Advances the stopped clock.
    pub fn pass(&self, passed: Duration) {
        self.shown_ns.fetch_add(u64::try_from(passed.as_nanos()).unwrap_or(u64::MAX), Relaxed);
    }

    /// Starts the clock from its current time at its next reading.
    pub fn go(&self) {
        self.goes.get_or_init(|| ());
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_stands_and_then_goes() {
        let real_s = Arc::new(AtomicU64::new(100));
        let read = real_s.clone();
        let hands = SetHands::default();
        let clock = hands.clock(Box::new(move || Duration::from_secs(read.load(Relaxed))));
        hands.pass(Duration::from_secs(7));
        real_s.store(150, Relaxed);
        assert_eq!(clock().as_secs(), 7);
        hands.go();
        assert_eq!(clock().as_secs(), 7);
        real_s.store(152, Relaxed);
        assert_eq!(clock().as_secs(), 9);
    }
}
