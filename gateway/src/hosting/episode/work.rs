//! The thread that plays an episode, from the start or the replay of the journal to the end or the
//! suspension.

use std::{
    sync::{Arc, PoisonError},
    thread,
    time::Duration,
};

use tandem_episodes::{BringBack, Clock, EpisodeError, RESULT_FILE, Session, build, monotonic};
use tandem_tools_spec::Briefing;
use tokio::sync::{mpsc, oneshot};

use super::{
    desk::{Desk, Job, Left, Log},
    panic_guard::{EpisodeMetrics, PanicGuard},
    stage::Stage,
};
use crate::hosting::{
    HostingError,
    durable::{Commit, JournalFile, JournalReader, Lease, Leasing},
};

/// Stack size in bytes; the contact solver keeps large temporaries on the stack.
const STACK_BYTES: usize = 8 << 20;

/// Origin of a thread's session.
pub enum Opening {
    /// The episode begins.
    New { clock: Clock, started: oneshot::Sender<Result<Briefing, EpisodeError>> },
    /// The episode is restored from its journal. `thinking` is the time since the last answer to the policy.
    Again { thinking: Duration },
}

/// Starts a thread that plays the episode.
pub fn spawn(stage: Arc<Stage>, opening: Opening, inbox: mpsc::Receiver<Job>) -> Result<(), HostingError> {
    let name = stage.id.clone();
    let thread = move || {
        // Every log line of this thread names the episode.
        let _named = tracing::info_span!("thread", episode = stage.id).entered();
        play(&stage, opening, inbox);
    };
    let builder = thread::Builder::new().name(name).stack_size(STACK_BYTES);
    builder.spawn(thread).map(drop).map_err(HostingError::Thread)
}

fn play(stage: &Arc<Stage>, opening: Opening, mut inbox: mpsc::Receiver<Job>) {
    let turn = stage.turn.lock().unwrap_or_else(PoisonError::into_inner);
    let desk = match opening {
        Opening::New { clock, started } => match stage.begin(clock) {
            Ok((session, briefing)) => {
                // If the caller has disconnected during the start, the sender of the inbox is dropped and
                // `work` returns.
                let _ = started.send(Ok(briefing));
                Desk::new(stage.clone(), session, None)
            }
            Err(error) => return drop(started.send(Err(error))),
        },
        Opening::Again { thinking } => match stage.bring_back(thinking) {
            Ok(desk) => desk,
            Err(why) => {
                tracing::warn!(%why, "not brought back");
                stage.status.fall_asleep(Duration::ZERO);
                drop(turn);
                inbox.close();
                let why = Arc::new(why);
                while let Some(job) = inbox.blocking_recv() {
                    job(Err(HostingError::Shared(why.clone())));
                }
                return;
            }
        },
    };
    let Left::Closed(closed) = desk.work(inbox) else { return };
    stage.feed.close();
    // The permit is released before the caller receives the result, so that the caller can start the next
    // episode.
    stage.place.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some((reply, result)) = closed {
        let _ = reply.send(*result);
    }
}

impl Stage {
    fn begin(&self, clock: Clock) -> Result<(PanicGuard, Briefing), EpisodeError> {
        let mut session = Session::start_with_clock(&self.spec, Some(self.folder.clone()), clock)?;
        if let Some(feed) = self.feed.end() {
            session.set_onlookers(Box::new(feed));
        }
        let briefing = session.briefing();
        Ok((PanicGuard::new(session, EpisodeMetrics::new(self.metrics.clone())), briefing))
    }

    /// Takes the lease and replays the journal.
    fn bring_back(self: &Arc<Self>, thinking: Duration) -> Result<Desk, HostingError> {
        let unknown = || HostingError::UnknownEpisode { id: self.id.clone() };
        let journals = self.journals.as_ref().ok_or_else(unknown)?;
        let path = journals.journal(&self.id).filter(|path| path.exists()).ok_or_else(unknown)?;
        let failed = |source| HostingError::Journal { path: path.clone(), source };
        let lease = match Lease::take(&path, &journals.url).map_err(failed)? {
            Leasing::Taken(lease) => lease,
            Leasing::Held { url } => return Err(HostingError::HeldElsewhere { id: self.id.clone(), url }),
        };
        let mut reader = JournalReader::open(&path).map_err(failed)?;
        let this = build().map_err(EpisodeError::Build)?;
        if reader.heading.build != this {
            let folder = self.folder.path.clone();
            return Err(HostingError::OtherBuild { made_by: reader.heading.build, this, folder });
        }
        let (mut entries, mut answers, mut notes, mut memory) = (Vec::new(), Vec::new(), Vec::new(), None);
        while let Some(commit) = reader.next_commit().map_err(failed)? {
            let Commit { mut asked, answers: mut told, notes: mut noted, memory: remembered } = commit;
            entries.append(&mut asked);
            answers.append(&mut told);
            notes.append(&mut noted);
            memory = remembered.or(memory);
        }
        // A complete recording is not written again.
        let is_written = entries.last().is_some_and(|entry| entry.ended.is_some())
            && self.folder.path.join(RESULT_FILE).exists();
        let session = Session::bring_back(BringBack {
            spec: self.spec.clone(),
            folder: (!is_written).then(|| self.folder.clone()),
            entries,
            clock: monotonic(),
            thinking,
            onlookers: self.feed.end().map(Box::new).ok_or(HostingError::EpisodeStopped)?,
        })?;
        let file = JournalFile::go_on(&path, reader, journals.durability).map_err(failed)?;
        let log = Log { file, lease, memory: memory.clone().unwrap_or_default() };
        self.memory.restore(memory, answers, notes);
        tracing::info!("brought back");
        let metrics = EpisodeMetrics::again(self.metrics.clone(), &session);
        let session = PanicGuard::again(session, metrics);
        self.status.update(&session);
        self.status.is_back();
        Ok(Desk::new(self.clone(), session, Some(log)))
    }
}
