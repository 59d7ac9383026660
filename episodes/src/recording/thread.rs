//! A recorder on a separate thread, so that an episode does not wait for encoding and compression.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::{Builder, JoinHandle, park_timeout};
use std::time::Duration;
use std::{io, iter, mem};

use super::write::Recorder;
use crate::output::OutputError;

/// Time for which appends are collected before one system call writes them. A killed process loses about as
/// much. Waking the thread for every step or call would take a core from the client that waits for the reply.
const GATHERED: Duration = Duration::from_millis(250);

/// Maximum number of pending appends before the episode waits for the recorder.
const WAITING_APPENDS: usize = 250;

/// Number of steps written to the system at once: fewer would make chunks that compress badly.
const GATHERED_STEPS: usize = 12;

/// Maximum number of steps that a killed process loses. At this number, the episode waits until the system
/// has them.
const UNWRITTEN_STEPS: usize = 25;

/// Number of pending images from which the recorder stops gathering; at `WAITING_PICTURES` the episode
/// waits for it. Images wait unencoded, a quarter of a megabyte each; the recorder encodes them.
const GATHERED_PICTURES: usize = 4;
const WAITING_PICTURES: usize = 16;

const PANICKED: &str = "the recorder panicked";

type Write = Box<dyn FnOnce(&mut Recorder) -> Result<(), OutputError> + Send>;

/// A request to the recorder.
enum Append {
    Step(Write),
    Other(Write),
    /// Writes out everything before this entry. The sender is dropped once that is done or has failed.
    /// Nothing is ever sent.
    Flush(SyncSender<()>),
}

/// Recorder that appends to a recording in the background, one append after the other.
pub struct RecorderThread {
    /// `None` once it is stopped.
    appends: Option<SyncSender<Append>>,
    thread: Option<JoinHandle<Option<Recorder>>>,
    /// The first failure. The recording ends there, because a gap would follow.
    failed: Arc<OnceLock<String>>,
    waiting_pictures: Arc<AtomicUsize>,
    /// Number of steps that have not been written to the system yet.
    unwritten_steps: Arc<AtomicUsize>,
    hurry: Arc<AtomicBool>,
    /// True while the episode is restored from a journal. The journal has its calls, so its steps may be
    /// written late.
    catches_up: bool,
}

impl RecorderThread {
    pub fn start(recorder: Recorder) -> io::Result<RecorderThread> {
        let (appends, inbox) = sync_channel(WAITING_APPENDS);
        let failed = Arc::new(OnceLock::new());
        let unwritten_steps = Arc::<AtomicUsize>::default();
        let hurry = Arc::<AtomicBool>::default();
        let appender = Appender {
            recorder,
            failed: failed.clone(),
            unwritten_steps: unwritten_steps.clone(),
            gathered_steps: 0,
            hurry: hurry.clone(),
        };
        let work = move || appender.run(&inbox);
        let thread = Builder::new().name("recorder".into()).spawn(work)?;
        Ok(RecorderThread {
            appends: Some(appends),
            thread: Some(thread),
            failed,
            waiting_pictures: Arc::default(),
            unwritten_steps,
            hurry,
            catches_up: false,
        })
    }

    /// Lets the episode run ahead of the recorder, or makes it wait again as usual.
    pub fn catch_up(&mut self, catches_up: bool) {
        self.catches_up = catches_up;
    }

    /// Queues an append after all earlier ones. The recorder executes it within a short time.
    pub fn append(&self, append: impl FnOnce(&mut Recorder) -> Result<(), OutputError> + Send + 'static) {
        self.send(Append::Other(Box::new(append)));
    }

    /// Appends a control step, as [`RecorderThread::append`] does.
    pub fn append_step(
        &self,
        append: impl FnOnce(&mut Recorder) -> Result<(), OutputError> + Send + 'static,
    ) {
        let count = self.unwritten_steps.fetch_add(1, Ordering::Relaxed) + 1;
        self.send(Append::Step(Box::new(append)));
        self.keep_up(count, GATHERED_STEPS, UNWRITTEN_STEPS);
    }

    /// Wakes the recorder from `gathered` pending items on, and makes the episode wait for it from
    /// `waiting` on.
    fn keep_up(&self, count: usize, gathered: usize, waiting: usize) {
        if count >= waiting && !self.catches_up {
            self.flush();
        } else if count >= gathered {
            self.wake();
        }
    }

    fn send(&self, append: Append) {
        let Some(appends) = &self.appends else { return };
        let sent = match appends.try_send(append) {
            Err(TrySendError::Full(append)) => {
                self.wake();
                appends.send(append).is_ok()
            }
            sent => sent.is_ok(),
        };
        if !sent {
            // A recorder that has failed has already reported the reason.
            self.failed.get_or_init(|| PANICKED.into());
        }
    }

    /// Appends something with this number of images, as [`RecorderThread::append`] does.
    pub fn append_pictures(
        &self,
        pictures: usize,
        append: impl FnOnce(&mut Recorder) -> Result<(), OutputError> + Send + 'static,
    ) {
        if pictures == 0 {
            return self.append(append);
        }
        let waiting = self.waiting_pictures.clone();
        let count = waiting.fetch_add(pictures, Ordering::Relaxed) + pictures;
        self.append(move |recorder| {
            let outcome = append(recorder);
            waiting.fetch_sub(pictures, Ordering::Relaxed);
            outcome
        });
        self.keep_up(count, GATHERED_PICTURES, WAITING_PICTURES);
    }

    /// Waits until all earlier appends are written to the system, or one has failed.
    pub fn flush(&self) {
        let (flushed, wait) = sync_channel::<()>(0);
        self.send(Append::Flush(flushed));
        self.wake();
        // The wait ends when the other side is gone, possibly because of an earlier failure.
        let _ = wait.recv();
    }

    /// Wakes the thread, so that it stops gathering.
    fn wake(&self) {
        if let Some(thread) = &self.thread {
            self.hurry.store(true, Ordering::Release);
            thread.thread().unpark();
        }
    }

    /// Returns the first failure up to now.
    pub fn failed(&self) -> Option<&str> {
        self.failed.get().map(String::as_str)
    }

    /// Waits until everything is appended. Returns the recorder, unless it has failed.
    pub fn stop(&mut self) -> Option<Recorder> {
        self.appends = None;
        self.wake();
        let stopped = self.thread.take()?.join();
        stopped.unwrap_or_else(|_| {
            self.failed.get_or_init(|| PANICKED.into());
            None
        })
    }
}

/// Waits for the thread, so that a recording that is dropped before its end is readable up to there.
impl Drop for RecorderThread {
    fn drop(&mut self) {
        self.stop();
    }
}

/// State of the recorder's thread.
struct Appender {
    recorder: Recorder,
    failed: Arc<OnceLock<String>>,
    unwritten_steps: Arc<AtomicUsize>,
    /// Steps since the last flush.
    gathered_steps: usize,
    /// Set when the thread is woken. The thread also parks while it waits for an append, and a wake-up from
    /// that leaves no trace.
    hurry: Arc<AtomicBool>,
}

impl Appender {
    /// Runs until all senders are gone, and returns the recorder. Returns `None` at its first failure.
    fn run(mut self, inbox: &Receiver<Append>) -> Option<Recorder> {
        while let Ok(first) = inbox.recv() {
            if !matches!(first, Append::Flush(_)) && !self.hurry.swap(false, Ordering::AcqRel) {
                park_timeout(GATHERED);
                // The append that caused the wake-up was sent before, and is taken up now.
                self.hurry.swap(false, Ordering::AcqRel);
            }
            let mut appends = iter::once(first).chain(inbox.try_iter());
            if !(appends.all(|append| self.append(append)) && self.flush()) {
                return None;
            }
        }
        Some(self.recorder)
    }

    /// Executes an append. Returns `false` after a failure.
    fn append(&mut self, append: Append) -> bool {
        match append {
            Append::Step(write) => {
                self.gathered_steps += 1;
                let outcome = write(&mut self.recorder);
                self.note(outcome) && (self.gathered_steps < GATHERED_STEPS || self.flush())
            }
            Append::Other(write) => {
                let outcome = write(&mut self.recorder);
                self.note(outcome)
            }
            // Dropping the sender also ends the wait after a failure.
            Append::Flush(flushed) => {
                let is_well = self.flush();
                drop(flushed);
                is_well
            }
        }
    }

    fn flush(&mut self) -> bool {
        let outcome = self.recorder.flush();
        self.unwritten_steps.fetch_sub(mem::take(&mut self.gathered_steps), Ordering::Relaxed);
        self.note(outcome)
    }

    fn note(&self, outcome: Result<(), OutputError>) -> bool {
        if let Err(error) = &outcome {
            self.failed.get_or_init(|| error.to_string());
        }
        outcome.is_ok()
    }
}
