//! Watchers of one episode. The episode's thread publishes events without waiting, so a slow watcher misses
//! the oldest events.

use std::{
    cell::Cell,
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicUsize, Ordering},
    },
    time::{Duration, Instant},
};

use tandem_episodes::live::{LiveEvent, LiveView, Onlookers, STEPS_PER_FRAME};
use tokio::sync::broadcast;

/// Number of events that a watcher may lag behind: ten simulated seconds.
const KEPT_EVENTS: usize = 256;

/// Minimum average time between two steps that watchers receive. A page does not draw more often.
const FRAME_INTERVAL: Duration = Duration::from_millis(20);

/// Maximum lead over an even rate of one step per `FRAME_INTERVAL`; within it, steps are sent at once.
///
/// The lead corresponds to ten simulated seconds, so all drawn steps of an agent's command are sent, however
/// fast it is simulated.
const MAX_LEAD: Duration = Duration::from_secs(5);

/// Events of an episode, for any number of watchers.
#[derive(Debug)]
pub struct LiveFeed {
    /// `None` once the episode's thread has ended.
    events: Mutex<Option<broadcast::Sender<LiveEvent>>>,
    /// Number of watchers that drive.
    drivers: Arc<AtomicUsize>,
}

/// Guard that makes the feed send every control step, not only those that are drawn.
pub struct EveryStep(Arc<AtomicUsize>);

/// A watcher's view: the state at the beginning, and the events from then on.
pub struct LiveWatch {
    /// State of the episode when the watch began.
    pub view: LiveView,
    /// Events after the subscription. `view` may already include the first of them.
    pub events: broadcast::Receiver<LiveEvent>,
}

/// Sending end of a feed, held by the episode's session.
pub struct FeedEnd {
    events: broadcast::Sender<LiveEvent>,
    drivers: Arc<AtomicUsize>,
    pace: Pace,
}

/// Rate limit of the steps that watchers receive.
struct Pace {
    /// Time until which the steps sent so far would last at the even rate of one step per `FRAME_INTERVAL`.
    even_at: Cell<Instant>,
}

impl LiveFeed {
    /// Creates a feed without watchers.
    pub fn new() -> LiveFeed {
        LiveFeed { events: Mutex::new(Some(broadcast::channel(KEPT_EVENTS).0)), drivers: Arc::default() }
    }

    /// Returns the sending end for the episode's session, or `None` once the feed is closed.
    pub fn end(&self) -> Option<FeedEnd> {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
        let pace = Pace { even_at: Cell::new(Instant::now()) };
        Some(FeedEnd { events, drivers: self.drivers.clone(), pace })
    }

    /// Returns true if there are watchers or drivers.
    pub fn is_watched(&self) -> bool {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        self.drivers.load(Ordering::Relaxed) > 0
            || events.as_ref().is_some_and(|events| events.receiver_count() > 0)
    }

    /// Makes the feed send every step for as long as the returned guard is held.
    pub fn every_step(&self) -> EveryStep {
        self.drivers.fetch_add(1, Ordering::Relaxed);
        EveryStep(self.drivers.clone())
    }

    /// Returns a receiver of the events from now on, or `None` once the feed is closed.
    pub fn subscribe(&self) -> Option<broadcast::Receiver<LiveEvent>> {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        events.as_ref().map(broadcast::Sender::subscribe)
    }

    /// Closes the feed, which ends all receivers.
    pub fn close(&self) {
        self.events.lock().unwrap_or_else(PoisonError::into_inner).take();
    }
}

impl Drop for EveryStep {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::Relaxed);
    }
}

impl Pace {
    /// Returns true if another step may be sent at `now`.
    fn allows(&self, now: Instant) -> bool {
        let even_at = self.even_at.get().max(now);
        let allowed = even_at.duration_since(now) < MAX_LEAD;
        if allowed {
            self.even_at.set(even_at + FRAME_INTERVAL);
        }
        allowed
    }
}

impl Onlookers for FeedEnd {
    fn wants_step(&self, control_step: u64) -> bool {
        self.drivers.load(Ordering::Relaxed) > 0
            || control_step.is_multiple_of(STEPS_PER_FRAME) && self.pace.allows(Instant::now())
    }

    fn any(&self) -> bool {
        self.events.receiver_count() > 0
    }

    fn tell(&self, event: LiveEvent) {
        // The last watcher may just have left.
        let _ = self.events.send(event);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_command_is_told_whole_and_what_goes_on_for_long_as_fast_as_it_is_drawn() {
        let begin = Instant::now();
        let pace = Pace { even_at: Cell::new(begin) };
        let mut told = 0;
        // The episode offers 800 steps per second for ten seconds.
        for step in 0..8000u32 {
            told += u32::from(pace.allows(begin + Duration::from_micros(1250) * step));
            if step == 200 {
                assert_eq!(told, 201, "four seconds of a robot's time at once");
            }
        }
        assert_eq!(told, 250 + 500);
        // After a pause, steps are sent in full again.
        let later = begin + Duration::from_secs(20);
        assert!((0..250).all(|_| pace.allows(later)) && !pace.allows(later));
    }
}
