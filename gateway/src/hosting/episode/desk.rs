//! Jobs on the thread of an episode, which owns the session. The effects of a job are written to the
//! episode's journal before its answer is sent.

use std::{
    sync::{Arc, atomic::Ordering::Relaxed},
    time::Duration,
};

use serde_json::Value;
use tandem_episodes::Session;
use tandem_tools_spec::{Note, ResultReply};
use tokio::sync::{mpsc, oneshot};

use super::{panic_guard::PanicGuard, stage::Stage};
use crate::hosting::{
    Answer, HostingError,
    durable::{Commit, Heading, JournalFile, KeptAnswer, Keyed, KeyedNote, Lease, Leasing},
};

/// A unit of work on an episode. Jobs run one after another. The argument is an error if the episode is not
/// available.
pub type Job = Box<dyn FnOnce(Result<&mut Desk, HostingError>) + Send>;

/// Outcome of a job.
pub type Outcome<T> = Result<T, HostingError>;

/// Sender of an episode's result to the caller that requested the end.
pub type ResultSender = oneshot::Sender<Outcome<ResultReply>>;

/// A session and the journal to which its calls are written.
pub struct Desk {
    stage: Arc<Stage>,
    session: PanicGuard,
    log: Option<Log>,
    /// True once the episode is to be suspended.
    sleeps: bool,
    closing: Option<Closing>,
}

/// The journal of an episode that this process plays.
pub struct Log {
    pub file: JournalFile,
    pub lease: Lease,
    /// Host memory as last written to the journal.
    pub memory: Value,
}

/// A request to close the episode.
pub struct Closing {
    /// True to keep the journal, so that the next server can restore the episode.
    pub keep: bool,
    pub reply: ResultSender,
}

/// Reason why the thread ended.
pub enum Left {
    /// Sender to the caller that requested the end, and the result to send once the permit is released.
    Closed(Option<(ResultSender, Box<Outcome<ResultReply>>)>),
    Asleep,
}

impl Desk {
    /// Creates the desk for `session`, whose calls are written to the journal `log`.
    pub fn new(stage: Arc<Stage>, session: PanicGuard, log: Option<Log>) -> Desk {
        Desk { stage, session, log, sleeps: false, closing: None }
    }

    /// Runs jobs until one closes or suspends the episode, or until all senders are dropped.
    pub fn work(mut self, mut inbox: mpsc::Receiver<Job>) -> Left {
        self.stage.status.update(&self.session);
        while let Some(job) = inbox.blocking_recv() {
            job(Ok(&mut self));
            if let Some(Closing { keep, reply }) = self.closing.take() {
                return Left::Closed(Some((reply, Box::new(self.close(keep)))));
            }
            if self.sleeps {
                // Jobs that are already queued still run; later jobs resume the episode.
                inbox.close();
            }
        }
        if self.sleeps {
            self.stage.memory.let_go();
            return Left::Asleep;
        }
        // No sender is left, so nobody receives the result.
        let _ = self.close(true);
        Left::Closed(None)
    }

    /// Runs `work` on the session.
    pub fn on_session<T>(&mut self, work: impl FnOnce(&mut Session) -> Outcome<T>) -> Outcome<T> {
        self.session.run(work).flatten()
    }

    /// Runs `work` on the session and writes its effects to the journal.
    pub fn run<T>(&mut self, work: impl FnOnce(&mut Session) -> Outcome<T>) -> Outcome<T> {
        let done = self.on_session(work);
        self.commit(None);
        done
    }

    /// Suspends the episode after the jobs that are queued now, if it can be resumed.
    pub fn sleep(&mut self) -> Outcome<()> {
        if self.log.is_some() {
            let thinking = self.session.run(|session| session.thinking()).unwrap_or_default();
            self.stage.status.fall_asleep(thinking);
            self.sleeps = true;
        }
        Ok(())
    }

    /// Closes the episode after this job.
    pub fn close_after_this(&mut self, closing: Closing) {
        self.closing = Some(closing);
    }

    /// Ends the episode if its policy has used up its thinking time, or has made no call for `idle`.
    pub fn end_if_abandoned(&mut self, idle: Duration) -> Outcome<()> {
        let goes_on = self.session.ended().is_none();
        self.run(|session| {
            session.end_if_abandoned(idle);
            Ok(())
        })?;
        if goes_on && self.session.ended().is_some() {
            tracing::info!("abandoned, and ended");
        }
        Ok(())
    }

    /// Records a note. `key` is its idempotency key, if it has one.
    pub fn note(&mut self, operator: Option<&str>, note: Note, key: Option<String>) -> Outcome<()> {
        let keyed = key.map(|key| KeyedNote { key, note: note.clone() });
        let kept = self.on_session(|session| Ok(session.note(operator, note)?));
        self.commit_noted(None, keyed.filter(|_| kept.is_ok()));
        kept
    }

    /// Writes the executed work to the journal, with the answers to calls that have a key.
    pub fn commit<'a>(&mut self, answers: impl IntoIterator<Item = (&'a Keyed, &'a Answer)>) {
        self.commit_noted(answers, None);
    }

    /// Does the same as [`Desk::commit`], and writes a recorded note that has a key.
    fn commit_noted<'a>(
        &mut self,
        answers: impl IntoIterator<Item = (&'a Keyed, &'a Answer)>,
        noted: Option<KeyedNote>,
    ) {
        self.stage.status.update(&self.session);
        let Some(log) = &mut self.log else { return };
        let written = self
            .session
            .run(|session| session.take_journal())
            .map_err(|panicked| panicked.to_string())
            .flatten()
            .and_then(|asked| {
                let kept = answers.into_iter().map(|(keyed, answer)| KeptAnswer::new(keyed, answer));
                let kept: Vec<KeptAnswer> =
                    kept.collect::<Result<_, _>>().map_err(|error| error.to_string())?;
                let now = self.stage.memory.memory();
                let memory = (now != log.memory).then(|| now.clone());
                log.memory = now;
                log.lease.renew();
                let commit = Commit { asked, answers: kept, notes: noted.into_iter().collect(), memory };
                match commit.is_empty() {
                    true => Ok(()),
                    false => log.file.append(&commit).map_err(|error| error.to_string()),
                }
            });
        if let Err(why) = written {
            tracing::error!(why, "the journal ends here; the episode goes on, and is not brought back");
            self.forget();
        }
    }

    /// Begins the journal from which the episode can be restored.
    pub fn begin_journal(&mut self, heading: &Heading) -> Outcome<()> {
        let Some(journals) = &self.stage.journals else { return Ok(()) };
        let Some(path) = journals.journal(&self.stage.id) else { return Ok(()) };
        let begun = journals.create().and_then(|()| match Lease::take(&path, &journals.url)? {
            Leasing::Taken(lease) => {
                let file = JournalFile::create(&path, heading, journals.durability)?;
                Ok(Log { file, lease, memory: self.stage.memory.memory() })
            }
            Leasing::Held { url } => {
                Err(std::io::Error::other(format!("{url} plays an episode of this name")))
            }
        });
        match begun {
            Ok(log) => {
                // The error after a panic is ignored, because there is no state to keep.
                let _ = self.session.run(Session::keep_journal);
                self.log = Some(log);
                self.stage.status.durable.store(true, Relaxed);
            }
            Err(error) => {
                tracing::warn!(%error, "no journal; a server that is started again does not bring it back")
            }
        }
        Ok(())
    }

    /// Removes the journal.
    fn forget(&mut self) {
        self.stage.status.durable.store(false, Relaxed);
        if let Some(Log { file, .. }) = self.log.take()
            && let Err(error) = file.remove()
        {
            tracing::error!(%error, "the journal stays");
        }
    }

    fn close(mut self, keep: bool) -> Outcome<ResultReply> {
        if !keep {
            self.forget();
        }
        let result = self.session.close();
        result.inspect(|result| drop(self.stage.status.result.set(result.clone())))
    }
}
