//! Connections to servers that are kept alive between requests, while other policies, people or the simulator
//! are active. Servers disconnect a client that leaves pings unanswered for too long.

use std::{
    sync::{Arc, Condvar, Mutex, MutexGuard, TryLockError},
    thread::{self, JoinHandle},
    time::{Duration, Instant},
};

use crate::client::PolicyClient;

/// Maximum time without a message to the server. The Python package websockets sends a ping after 20 s and
/// closes the connection after another 20 s.
const LONGEST_SILENCE: Duration = Duration::from_secs(5);

/// A client whose connection stays open while this value exists, even if it is idle.
pub struct KeptClient {
    shared: Arc<SharedClient>,
    keeper: Option<JoinHandle<()>>,
}

struct SharedClient {
    client: Mutex<UsedClient>,
    is_dropped: Mutex<bool>,
    dropped: Condvar,
}

struct UsedClient {
    client: Box<dyn PolicyClient>,
    /// Time of the last message to the server.
    used: Instant,
}

impl KeptClient {
    /// Keeps a client's connection alive from now on.
    pub fn new(client: Box<dyn PolicyClient>) -> KeptClient {
        KeptClient::beating(client, LONGEST_SILENCE)
    }

    fn beating(client: Box<dyn PolicyClient>, every: Duration) -> KeptClient {
        let client = Mutex::new(UsedClient { client, used: Instant::now() });
        let shared =
            Arc::new(SharedClient { client, is_dropped: Mutex::new(false), dropped: Condvar::new() });
        let kept = shared.clone();
        let keeper = thread::Builder::new().name("policy's connection".into());
        // If no thread can be started, the server's pings are not answered while the client is idle.
        let keeper = keeper.spawn(move || kept.keep_alive(every)).ok();
        KeptClient { shared, keeper }
    }

    /// Runs `work` on the client.
    pub fn with<T>(&self, work: impl FnOnce(&mut dyn PolicyClient) -> T) -> T {
        let mut used = self.shared.client.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
        let came = work(&mut *used.client);
        used.used = Instant::now();
        came
    }
}

impl SharedClient {
    /// Sends a keep-alive message whenever the client has been idle for `every`.
    fn keep_alive(&self, every: Duration) {
        loop {
            let waited = self.dropped.wait_timeout_while(self.is_dropped(), every, |is_dropped| !*is_dropped);
            let (is_dropped, _) = waited.unwrap_or_else(|poisoned| poisoned.into_inner());
            if *is_dropped {
                return;
            }
            drop(is_dropped);
            let mut used = match self.client.try_lock() {
                Ok(used) => used,
                Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
                // A request is in progress.
                Err(TryLockError::WouldBlock) => continue,
            };
            if used.used.elapsed() >= every {
                used.client.keep_alive();
            }
        }
    }

    fn is_dropped(&self) -> MutexGuard<'_, bool> {
        // No thread panics while it holds the lock.
        self.is_dropped.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

impl Drop for KeptClient {
    fn drop(&mut self) {
        *self.shared.is_dropped() = true;
        self.shared.dropped.notify_all();
        // The connection closes before `drop` returns.
        self.keeper.take().map(JoinHandle::join);
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc;

    use super::*;
    use crate::{
        error::RemoteError,
        values::{ReplyValue, RequestValue},
    };

    /// A client that reports every keep-alive message.
    struct Beaten(mpsc::Sender<()>);

    impl PolicyClient for Beaten {
        fn ask(&mut self, _: &RequestValue, _: Duration) -> Result<ReplyValue, RemoteError> {
            Ok(ReplyValue::number(1.0))
        }

        fn begin_trial(&mut self, _: Duration) -> Result<(), RemoteError> {
            Ok(())
        }

        fn keep_alive(&mut self) {
            // The test may have ended.
            let _ = self.0.send(());
        }
    }

    #[test]
    fn a_server_that_nobody_asks_is_kept_alive_until_the_client_is_dropped() {
        let (beaten, beats) = mpsc::channel();
        let kept = KeptClient::beating(Box::new(Beaten(beaten)), Duration::from_millis(1));
        beats.recv().unwrap();
        beats.recv().unwrap();
        let answer = kept.with(|client| client.ask(&RequestValue::List(Vec::new()), Duration::ZERO));
        assert_eq!(answer.unwrap(), ReplyValue::number(1.0));
        drop(kept);
        while beats.try_recv().is_ok() {}
        assert_eq!(beats.recv(), Err(mpsc::RecvError), "the client is gone");
    }
}
