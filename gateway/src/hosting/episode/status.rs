//! State of an episode that is readable without a request to its thread.

use std::{
    sync::{
        Mutex, MutexGuard, OnceLock,
        atomic::{
            AtomicBool, AtomicU32, AtomicU64,
            Ordering::{Acquire, Relaxed, Release},
        },
    },
    time::{Duration, Instant},
};

use tandem_episodes::JournalEntry;
use tandem_tools_spec::{EndReason, ResultReply};

use super::PanicGuard;

#[derive(Debug)]
pub struct SharedStatus {
    /// Reason why the episode takes no more commands.
    pub ended: OnceLock<EndReason>,
    env_steps: AtomicU32,
    /// First failure of the recording.
    pub recording_failed: OnceLock<String>,
    /// Policy's thinking time in nanoseconds.
    thought: AtomicU64,
    /// Result of the episode once it has been closed.
    pub result: OnceLock<ResultReply>,
    /// True if the episode has a journal to resume from, so that it can be suspended.
    pub durable: AtomicBool,
    sleep: Mutex<Option<Sleep>>,
    /// False from the suspension until the state from before it is restored.
    there: AtomicBool,
    /// Time of the last request.
    used: Mutex<Instant>,
    /// Reason why the last refused call was refused.
    refusal: Mutex<Option<String>>,
}

/// Data of a suspended episode.
#[derive(Debug, Clone, Copy)]
pub struct Sleep {
    pub since: Instant,
    /// Time between the last answer to the policy and the suspension.
    pub thinking: Duration,
}

impl Default for SharedStatus {
    fn default() -> SharedStatus {
        SharedStatus {
            ended: OnceLock::new(),
            env_steps: AtomicU32::new(0),
            recording_failed: OnceLock::new(),
            thought: AtomicU64::new(0),
            result: OnceLock::new(),
            durable: AtomicBool::new(false),
            sleep: Mutex::default(),
            there: AtomicBool::new(true),
            used: Mutex::new(Instant::now()),
            refusal: Mutex::default(),
        }
    }
}

impl SharedStatus {
    /// Returns the status of a suspended episode whose journal contains `entries`.
    pub fn asleep<'a>(entries: impl Iterator<Item = &'a JournalEntry>, hold_steps: u32) -> SharedStatus {
        let status = SharedStatus::default();
        let mut first = None;
        for entry in entries {
            if let Some(step) = entry.control_step() {
                first.get_or_insert(step);
                status.env_steps.store(u32::try_from(step).unwrap_or(u32::MAX), Relaxed);
            }
            status.thought.store(entry.thought().as_nanos() as u64, Relaxed);
            if let Some(reason) = entry.ended {
                status.ended.get_or_init(|| reason);
            }
        }
        status.env_steps.fetch_max(hold_steps, Relaxed);
        status.durable.store(true, Relaxed);
        status.fall_asleep(Duration::ZERO);
        status
    }

    /// Updates the status from the state of `session`.
    pub fn update(&self, session: &PanicGuard) {
        if let Some(reason) = session.ended() {
            self.ended.get_or_init(|| reason);
        }
        if let Some(env_steps) = session.env_steps() {
            self.env_steps.store(env_steps, Relaxed);
        }
        if let Some(thought) = session.thought() {
            self.thought.store(thought.as_nanos() as u64, Relaxed);
        }
        if let Some(reason) = session.recording_failed() {
            self.recording_failed.get_or_init(|| reason.to_owned());
        }
    }

    pub fn env_steps(&self) -> u32 {
        self.env_steps.load(Relaxed)
    }

    /// Raises the number of executed control steps to at least `env_steps`.
    pub fn reach(&self, env_steps: u32) {
        self.env_steps.fetch_max(env_steps, Relaxed);
    }

    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought.load(Relaxed))
    }

    /// Sets the time of the last request to now.
    pub fn is_used(&self) {
        *lock(&self.used) = Instant::now();
    }

    pub fn idle(&self) -> Duration {
        lock(&self.used).elapsed()
    }

    /// Stores the reason why a call was refused.
    pub fn refuse(&self, why: String) {
        *lock(&self.refusal) = Some(why);
    }

    pub fn last_refusal(&self) -> Option<String> {
        lock(&self.refusal).clone()
    }

    /// Marks the episode as suspended. `thinking` is the time since the last answer to the policy.
    pub fn fall_asleep(&self, thinking: Duration) {
        self.there.store(false, Release);
        *lock(&self.sleep) = Some(Sleep { since: Instant::now(), thinking });
    }

    /// Marks the episode as suspended again with the same data, after it could not be resumed.
    pub fn sleep_on(&self, sleep: Sleep) {
        *lock(&self.sleep) = Some(sleep);
    }

    pub fn sleep(&self) -> Option<Sleep> {
        *lock(&self.sleep)
    }

    /// Marks the state from before the suspension as restored.
    pub fn is_back(&self) {
        self.there.store(true, Release);
    }

    pub fn is_there(&self) -> bool {
        self.there.load(Acquire)
    }

    pub fn wake_up(&self) -> Option<Sleep> {
        lock(&self.sleep).take()
    }
}

impl Sleep {
    /// Returns the time since the policy was last answered.
    pub fn thinking(&self) -> Duration {
        self.thinking + self.since.elapsed()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing panics while it holds the lock.
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
