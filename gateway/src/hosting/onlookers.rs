//! Those who look on at one episode: its thread hands over what happens and waits for nobody; who is too slow misses what was longest ago.

use std::sync::{
    Arc, Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use tandem_episodes::live::{LiveEvent, LiveView, Onlookers};
use tokio::sync::broadcast;

/// How far an onlooker may lag behind: ten simulated seconds.
const KEPT_EVENTS: usize = 256;

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
}

impl LiveFeed {
    /// A feed, and its end for the episode's session.
    pub fn new() -> (LiveFeed, FeedEnd) {
        let (events, _) = broadcast::channel(KEPT_EVENTS);
        let drivers: Arc<AtomicUsize> = Arc::default();
        let feed = LiveFeed { events: Mutex::new(Some(events.clone())), drivers: drivers.clone() };
        (feed, FeedEnd { events, drivers })
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

impl Onlookers for FeedEnd {
    fn every_step(&self) -> bool {
        self.drivers.load(Ordering::Relaxed) > 0
    }

    fn any(&self) -> bool {
        self.events.receiver_count() > 0
    }

    fn tell(&self, event: LiveEvent) {
        // Where the last listener has just gone, nobody misses it.
        let _ = self.events.send(event);
    }
}
