//! Those who look on at one episode: its thread hands over what happens and waits for nobody; who is too slow misses what was longest ago.

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

/// How far an onlooker may lag behind: ten simulated seconds.
const KEPT_EVENTS: usize = 256;

/// Those who watch are told no more steps than one in this time, for long: a page draws no more.
const FRAME_INTERVAL: Duration = Duration::from_millis(20);

/// Steps are told at once that are worth so many intervals, so that what an agent commands now and then is told whole, however fast
/// it is simulated: ten simulated seconds.
const MAX_LEAD: Duration = Duration::from_secs(5);

/// What an episode tells, for as many as listen.
#[derive(Debug)]
pub struct LiveFeed {
    /// `None` once the episode's thread has ended.
    events: Mutex<Option<broadcast::Sender<LiveEvent>>>,
    /// How many of them drive.
    drivers: Arc<AtomicUsize>,
}

/// While it is held, every control step is told, and not only as many as are drawn.
pub struct EveryStep(Arc<AtomicUsize>);

/// What an onlooker gets: how things stand, and what happens from then on.
pub struct LiveWatch {
    /// As the episode stood when the watch began.
    pub view: LiveView,
    /// What happens then. Some of it may be in `view` already.
    pub events: broadcast::Receiver<LiveEvent>,
}

/// The end of a feed that an episode's session holds.
pub struct FeedEnd {
    events: broadcast::Sender<LiveEvent>,
    drivers: Arc<AtomicUsize>,
    pace: Pace,
}

/// How many steps those who watch are told.
struct Pace {
    /// When all that was told would have been told at one step an interval.
    even_at: Cell<Instant>,
}

impl LiveFeed {
    /// A feed to which nobody listens yet.
    pub fn new() -> LiveFeed {
        LiveFeed { events: Mutex::new(Some(broadcast::channel(KEPT_EVENTS).0)), drivers: Arc::default() }
    }

    /// The end for the episode's session, unless nothing happens any more.
    pub fn end(&self) -> Option<FeedEnd> {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner).clone()?;
        let pace = Pace { even_at: Cell::new(Instant::now()) };
        Some(FeedEnd { events, drivers: self.drivers.clone(), pace })
    }

    /// Whether anybody listens or drives.
    pub fn is_watched(&self) -> bool {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        self.drivers.load(Ordering::Relaxed) > 0
            || events.as_ref().is_some_and(|events| events.receiver_count() > 0)
    }

    /// Tells every step for as long as the return value is held.
    pub fn every_step(&self) -> EveryStep {
        self.drivers.fetch_add(1, Ordering::Relaxed);
        EveryStep(self.drivers.clone())
    }

    /// What happens from now on, unless nothing does any more.
    pub fn subscribe(&self) -> Option<broadcast::Receiver<LiveEvent>> {
        let events = self.events.lock().unwrap_or_else(PoisonError::into_inner);
        events.as_ref().map(broadcast::Sender::subscribe)
    }

    /// Nothing happens any more: who listens is told.
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
    /// Whether one step more may be told at `now`.
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
        // Where the last listener has just gone, nobody misses it.
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
        // 800 steps a second that could be told, for ten seconds.
        for step in 0..8000u32 {
            told += u32::from(pace.allows(begin + Duration::from_micros(1250) * step));
            if step == 200 {
                assert_eq!(told, 201, "four seconds of a robot's time at once");
            }
        }
        assert_eq!(told, 250 + 500);
        // Whoever pauses is told whole again.
        let later = begin + Duration::from_secs(20);
        assert!((0..250).all(|_| pace.allows(later)) && !pace.allows(later));
    }
}
