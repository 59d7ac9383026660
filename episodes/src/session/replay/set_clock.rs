//! A clock that shows what it is told while an episode is played again, and then goes on by itself.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, OnceLock};
use std::time::Duration;

use crate::session::Clock;

/// The hands of a clock that stands until it is told to go on.
#[derive(Clone, Default)]
pub struct SetHands {
    shown_ns: Arc<AtomicU64>,
    /// Whether it goes.
    goes: Arc<OnceLock<()>>,
}

impl SetHands {
    /// The clock with these hands, which runs as `running` does once it goes.
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

    /// Turns the hands on by this much.
    pub fn pass(&self, passed: Duration) {
        self.shown_ns.fetch_add(u64::try_from(passed.as_nanos()).unwrap_or(u64::MAX), Relaxed);
    }

    /// Lets the clock go on from what it shows when it is next looked at.
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
