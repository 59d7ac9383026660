//! What the thread of an episode lets everybody know without being asked.

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
    /// Why the episode takes no more commands.
    pub ended: OnceLock<EndReason>,
    env_steps: AtomicU32,
    /// The first failure of the recording.
    pub recording_failed: OnceLock<String>,
    /// How long the policy has thought, in nanoseconds.
    thought: AtomicU64,
    /// What the episode came to, once it has been closed.
    pub result: OnceLock<ResultReply>,
    /// Whether it can be brought back, and so put aside.
    pub durable: AtomicBool,
    sleep: Mutex<Option<Sleep>>,
    /// Whether all is there that it had before it was put aside. It is woken up before that.
    there: AtomicBool,
    /// When it was asked for something last.
    used: Mutex<Instant>,
}

/// An episode that has been put aside.
#[derive(Debug, Clone, Copy)]
pub struct Sleep {
    pub since: Instant,
    /// How long the policy had been thinking by then.
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
        }
    }
}

impl SharedStatus {
    /// That of an episode which sleeps where `entries` have brought it.
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

    /// Takes over how `session` stands.
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

    /// At least so many control steps have been executed.
    pub fn reach(&self, env_steps: u32) {
        self.env_steps.fetch_max(env_steps, Relaxed);
    }

    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought.load(Relaxed))
    }

    /// It is asked for something.
    pub fn is_used(&self) {
        *lock(&self.used) = Instant::now();
    }

    pub fn idle(&self) -> Duration {
        lock(&self.used).elapsed()
    }

    /// It is put aside, its policy having thought for so long since it was last answered.
    pub fn fall_asleep(&self, thinking: Duration) {
        self.there.store(false, Release);
        *lock(&self.sleep) = Some(Sleep { since: Instant::now(), thinking });
    }

    /// It is put aside as it was before.
    pub fn sleep_on(&self, sleep: Sleep) {
        *lock(&self.sleep) = Some(sleep);
    }

    pub fn sleep(&self) -> Option<Sleep> {
        *lock(&self.sleep)
    }

    /// All is there that it had before it was put aside.
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
    /// How long the policy has been thinking since it was last answered.
    pub fn thinking(&self) -> Duration {
        self.thinking + self.since.elapsed()
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing panics while it holds the lock.
    mutex.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
}
