//! A cache of replies by idempotency key. A caller that missed a reply can repeat its request without
//! repeating the action.

use std::{
    collections::VecDeque,
    sync::{Mutex, MutexGuard},
};

use tokio::sync::watch;

use super::HostingError;

/// Maximum number of cached replies. A reply with images may take a megabyte.
const CAPACITY: usize = 16;

/// Replies `R` to requests `Q`, by the idempotency key of the request.
#[derive(Debug)]
pub struct IdempotencyCache<Q, R> {
    entries: Mutex<VecDeque<Entry<Q, R>>>,
}

#[derive(Debug)]
struct Entry<Q, R> {
    key: String,
    request: Q,
    reply: watch::Receiver<Option<R>>,
}

/// A reply, with a flag for a reply that an earlier request produced.
#[derive(Debug, PartialEq)]
pub struct IdempotentReply<R> {
    /// The reply itself.
    pub reply: R,
    /// True if an earlier request with the same key started the work.
    pub replayed: bool,
}

impl<Q, R> Default for IdempotencyCache<Q, R> {
    fn default() -> IdempotencyCache<Q, R> {
        IdempotencyCache { entries: Mutex::default() }
    }
}

impl<Q: PartialEq + Clone, R: Clone + Send + Sync + 'static> IdempotencyCache<Q, R> {
    /// Runs `work` once per key to produce the reply to `request`. Later requests with the same key get that
    /// reply, and wait for it if necessary.
    ///
    /// A reply that is not `lasting` is forgotten, so that a repeated request tries again. The work
    /// continues if its caller leaves.
    ///
    /// # Errors
    ///
    /// Returns an error if the key came with a different request before, or if the work panicked.
    pub async fn once(
        &self,
        key: &str,
        request: Q,
        work: impl Future<Output = R> + Send + 'static,
        lasting: impl Fn(&R) -> bool,
    ) -> Result<IdempotentReply<R>, HostingError> {
        let (mut reply, replayed) = self.find_or_begin(key, request, work)?;
        let made = reply.wait_for(Option::is_some).await.map(|made| made.clone());
        // Work that panicked produced no reply. The panic is reported as an episode that has stopped.
        let Ok(Some(made)) = made else {
            self.forget(key);
            return Err(HostingError::EpisodeStopped);
        };
        if !lasting(&made) {
            self.forget(key);
        }
        Ok(IdempotentReply { reply: made, replayed })
    }

    /// Returns a receiver of the reply, and true if an earlier request has started the work.
    fn find_or_begin(
        &self,
        key: &str,
        request: Q,
        work: impl Future<Output = R> + Send + 'static,
    ) -> Result<(watch::Receiver<Option<R>>, bool), HostingError> {
        let mut entries = self.lock();
        if let Some(entry) = entries.iter().find(|entry| entry.key == key) {
            return match entry.request == request {
                true => Ok((entry.reply.clone(), true)),
                false => Err(HostingError::KeyUsed),
            };
        }
        let (sender, reply) = watch::channel(None);
        entries.push_back(Entry { key: key.into(), request, reply: reply.clone() });
        if entries.len() > CAPACITY {
            entries.pop_front();
        }
        tokio::spawn(async move {
            sender.send_replace(Some(work.await));
        });
        Ok((reply, false))
    }

    /// Stores a reply that was produced elsewhere.
    pub fn keep(&self, key: String, request: Q, reply: R) {
        let (_, reply) = watch::channel(Some(reply));
        let mut entries = self.lock();
        entries.retain(|entry| entry.key != key);
        entries.push_back(Entry { key, request, reply });
        if entries.len() > CAPACITY {
            entries.pop_front();
        }
    }

    /// Removes all replies whose work is complete.
    pub fn clear(&self) {
        let mut entries = self.lock();
        entries.retain(|entry| entry.reply.borrow().is_none());
        entries.shrink_to_fit();
    }

    fn forget(&self, key: &str) {
        self.lock().retain(|entry| entry.key != key);
    }

    fn lock(&self) -> MutexGuard<'_, VecDeque<Entry<Q, R>>> {
        // Nothing panics while it holds the lock.
        self.entries.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use std::sync::{
        Arc,
        atomic::{AtomicU32, Ordering::Relaxed},
    };

    use super::*;

    /// A test double that increments a counter and replies with it.
    struct Counting {
        cache: IdempotencyCache<&'static str, u32>,
        count: Arc<AtomicU32>,
    }

    impl Counting {
        fn new() -> Counting {
            Counting { cache: IdempotencyCache::default(), count: Arc::default() }
        }

        async fn ask(&self, key: &str, request: &'static str) -> Result<IdempotentReply<u32>, HostingError> {
            let count = self.count.clone();
            let work = async move {
                tokio::task::yield_now().await;
                count.fetch_add(1, Relaxed) + 1
            };
            self.cache.once(key, request, work, |count| count % 2 == 1).await
        }
    }

    #[tokio::test]
    async fn a_key_stands_for_one_reply() {
        let counting = Counting::new();
        assert_eq!(counting.ask("k", "wait").await.unwrap(), IdempotentReply { reply: 1, replayed: false });
        assert_eq!(counting.ask("k", "wait").await.unwrap(), IdempotentReply { reply: 1, replayed: true });
        let refused = counting.ask("k", "walk").await.unwrap_err();
        assert!(matches!(refused, HostingError::KeyUsed), "{refused}");
        assert_eq!(counting.count.load(Relaxed), 1);
    }

    #[tokio::test]
    async fn what_does_not_last_is_made_anew() {
        let counting = Counting::new();
        counting.ask("k", "wait").await.unwrap();
        assert_eq!(counting.ask("l", "wait").await.unwrap(), IdempotentReply { reply: 2, replayed: false });
        assert_eq!(counting.ask("l", "wait").await.unwrap(), IdempotentReply { reply: 3, replayed: false });
    }

    #[tokio::test]
    async fn who_asks_meanwhile_waits_for_the_same() {
        let counting = Counting::new();
        let (one, other) = tokio::join!(counting.ask("k", "wait"), counting.ask("k", "wait"));
        assert_eq!((one.unwrap().reply, other.unwrap().reply), (1, 1));
    }

    #[tokio::test]
    async fn the_oldest_replies_are_forgotten() {
        let counting = Counting::new();
        for key in 0..=CAPACITY {
            counting.cache.once(&key.to_string(), "wait", async { 1 }, |_| true).await.unwrap();
        }
        let again =
            async |key: &str| counting.cache.once(key, "wait", async { 1 }, |_| true).await.unwrap().replayed;
        assert!(again("1").await && !again("0").await);
    }
}
