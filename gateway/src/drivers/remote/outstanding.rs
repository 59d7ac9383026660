//! Servers that are asked side by side: whoever has answered is kept company until all have, because servers take a client that is silent
//! for long to be gone.

use std::{
    sync::{Condvar, Mutex, MutexGuard},
    time::Duration,
};

use super::client::PolicyClient;

/// How long a server hears nothing. Python's websockets asks after 20 s whether anybody is there, and closes after 20 s more.
const LONGEST_SILENCE: Duration = Duration::from_secs(5);

/// How many answers are waited for still.
#[derive(Debug, Default)]
pub struct Outstanding {
    left: Mutex<usize>,
    all_in: Condvar,
}

/// One answer that is waited for, until this is dropped.
pub struct Busy<'a>(&'a Outstanding);

impl Outstanding {
    /// So many answers more are waited for: all of them from now on, however soon the first one comes.
    pub fn more(&self, count: usize) -> Vec<Busy<'_>> {
        *self.left() += count;
        (0..count).map(|_| Busy(self)).collect()
    }

    /// Keeps the connection of one that has answered alive until all have.
    pub fn keep_alive(&self, client: &mut dyn PolicyClient) {
        self.wait(LONGEST_SILENCE, || client.keep_alive());
    }

    fn wait(&self, every: Duration, mut beat: impl FnMut()) {
        loop {
            let waited = self.all_in.wait_timeout_while(self.left(), every, |left| *left > 0);
            let (left, timeout) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
            drop(left);
            if !timeout.timed_out() {
                return;
            }
            beat();
        }
    }

    fn left(&self) -> MutexGuard<'_, usize> {
        // Nothing panics while it holds the lock.
        self.left.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Drop for Busy<'_> {
    fn drop(&mut self) {
        let mut left = self.0.left();
        *left -= 1;
        if *left == 0 {
            self.0.all_in.notify_all();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;

    #[test]
    fn who_is_done_is_kept_alive_until_all_are() {
        let outstanding = Outstanding::default();
        let mut busy = outstanding.more(2).into_iter();
        let (first, second) = (busy.next(), busy.next());
        let (beaten, beats) = mpsc::channel();
        std::thread::scope(|scope| {
            let outstanding = &outstanding;
            scope.spawn(move || {
                drop(first);
                outstanding.wait(Duration::from_millis(1), || beaten.send(()).unwrap());
            });
            // The other takes as long as two heartbeats.
            beats.recv().unwrap();
            beats.recv().unwrap();
            drop(second);
        });
        let mut more = 0;
        outstanding.wait(Duration::ZERO, || more += 1);
        assert_eq!(more, 0, "nobody is waited for");
    }
}
