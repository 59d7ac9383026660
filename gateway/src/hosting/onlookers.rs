//! Those who look on at one episode: its thread hands over what happens and waits for nobody; who is too slow misses what was longest ago.

use std::sync::{Mutex, PoisonError};

use tandem_episodes::live::{LiveEvent, LiveView, Onlookers};
use tokio::sync::broadcast;

/// How far an onlooker may lag behind: ten simulated seconds.
const KEPT_EVENTS: usize = 256;

/// What an episode tells, for as many as listen.
#[derive(Debug)]
pub struct LiveFeed {
    /// `None` once the episode's thread has ended.
    events: Mutex<Option<broadcast::Sender<LiveEvent>>>,
}

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
}

impl LiveFeed {
    /// A feed, and its end for the episode's session.
    pub fn new() -> (LiveFeed, FeedEnd) {
        let (events, _) = broadcast::channel(KEPT_EVENTS);
        (LiveFeed { events: Mutex::new(Some(events.clone())) }, FeedEnd { events })
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

impl Onlookers for FeedEnd {
    fn any(&self) -> bool {
        self.events.receiver_count() > 0
    }

    fn tell(&self, event: LiveEvent) {
        // Where the last listener has just gone, nobody misses it.
        let _ = self.events.send(event);
    }
}
