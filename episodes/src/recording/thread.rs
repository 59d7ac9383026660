//! A recorder on a thread of its own, so that an episode does not wait while what it left behind is encoded and compressed.

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::mpsc::{Receiver, SyncSender, TrySendError, sync_channel};
use std::sync::{Arc, OnceLock};
use std::thread::{Builder, JoinHandle, park_timeout};
use std::time::Duration;
use std::{io, iter};

use super::write::Recorder;
use crate::output::OutputError;

/// What comes within this time is appended in one go and handed to the system; a process that is killed loses about so much.
/// Being woken for every step or call would take a core from who waits for the answer.
const GATHERED: Duration = Duration::from_millis(250);

/// Appends that may wait, five seconds of an episode, before the episode waits for the recorder.
const WAITING_APPENDS: usize = 250;

/// Pictures wait as they were drawn, a quarter of a megabyte each, and are encoded by the recorder. From so many on it gathers no
/// longer, and from so many on the episode waits for it.
const GATHERED_PICTURES: usize = 4;
const WAITING_PICTURES: usize = 16;

const PANICKED: &str = "the recorder panicked";

type Append = Box<dyn FnOnce(&mut Recorder) -> Result<(), OutputError> + Send>;

/// Appends to a recording one after the other, behind the caller's back.
pub struct RecorderThread {
    /// `None` once it is stopped.
    appends: Option<SyncSender<Append>>,
    thread: Option<JoinHandle<Option<Recorder>>>,
    /// The first failure. The recording would have a hole after it, so it ends there.
    failed: Arc<OnceLock<String>>,
    waiting_pictures: Arc<AtomicUsize>,
}

impl RecorderThread {
    pub fn start(recorder: Recorder) -> io::Result<RecorderThread> {
        let (appends, inbox) = sync_channel(WAITING_APPENDS);
        let failed = Arc::new(OnceLock::new());
        let failure = failed.clone();
        let work = move || append_all(recorder, &inbox, &failure);
        let thread = Builder::new().name("recorder".into()).spawn(work)?;
        Ok(RecorderThread {
            appends: Some(appends),
            thread: Some(thread),
            failed,
            waiting_pictures: Arc::default(),
        })
    }

    /// Appends after everything that was appended before, some time soon.
    pub fn append(&self, append: impl FnOnce(&mut Recorder) -> Result<(), OutputError> + Send + 'static) {
        let Some(appends) = &self.appends else { return };
        let sent = match appends.try_send(Box::new(append)) {
            Err(TrySendError::Full(append)) => {
                self.wake();
                appends.send(append).is_ok()
            }
            sent => sent.is_ok(),
        };
        if !sent {
            // Where it has failed, it has said why.
            self.failed.get_or_init(|| PANICKED.into());
        }
    }

    /// As [`RecorderThread::append`], of something that holds so many pictures.
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
        match count {
            ..GATHERED_PICTURES => {}
            GATHERED_PICTURES..WAITING_PICTURES => self.wake(),
            WAITING_PICTURES.. => self.flush(),
        }
    }

    /// Waits until the system has everything that was appended so far, or one of it has failed.
    pub fn flush(&self) {
        let (flushed, wait) = sync_channel::<()>(0);
        let failed = self.failed.clone();
        self.append(move |recorder| {
            let outcome = recorder.flush();
            note(&failed, &outcome);
            drop(flushed);
            outcome
        });
        self.wake();
        // Nothing is ever sent; it ends when the other side is gone, be it by a failure before.
        let _ = wait.recv();
    }

    /// Gathers no longer.
    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }

    /// The first failure of what has been appended so far.
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

/// A recording that is dropped before its end is readable to where it stopped by then.
impl Drop for RecorderThread {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Returns the recorder when nobody is left who appends, or nothing at its first failure.
fn append_all(
    mut recorder: Recorder,
    inbox: &Receiver<Append>,
    failed: &OnceLock<String>,
) -> Option<Recorder> {
    while let Ok(first) = inbox.recv() {
        park_timeout(GATHERED);
        let mut appends = iter::once(first).chain(inbox.try_iter());
        let appended = appends.try_for_each(|append| append(&mut recorder)).and_then(|()| recorder.flush());
        note(failed, &appended);
        if appended.is_err() {
            return None;
        }
    }
    Some(recorder)
}

fn note(failed: &OnceLock<String>, outcome: &Result<(), OutputError>) {
    if let Err(error) = outcome {
        failed.get_or_init(|| error.to_string());
    }
}
