//! The main loop of an episode's thread. Each job is written to the episode's journal before it is
//! answered.

use std::{
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::Duration,
};

use serde_json::Value;
use tandem_episodes::{
    BringBack, CallReply, Clock, EpisodeError, EpisodeSpec, RESULT_FILE, RunFolder, Session, build,
    live::LiveView, monotonic,
};
use tandem_tools_spec::{Briefing, Call, ManageReply, Note, ResultReply, ToolReply};
use tokio::sync::{OwnedSemaphorePermit, mpsc, oneshot};

use super::{
    Surroundings,
    job::{Job, ReplySender},
    onlookers::{FeedEnd, LiveFeed},
    panic_guard::{EpisodeMetrics, PanicGuard},
    status::SharedStatus,
};
use crate::{
    hosting::{
        Answer, HostingError, RefusedCall,
        durable::{
            Commit, Heading, JournalFile, JournalReader, KeptAnswer, Keyed, KeyedNote, Lease, Leasing,
            LiveFolder,
        },
    },
    metrics::Metrics,
};

/// Stack size; the contact solver keeps large temporaries on the stack.
const STACK_BYTES: usize = 8 << 20;

/// State that a host keeps of an episode besides its world.
pub trait HostMemory: std::fmt::Debug + Send + Sync {
    /// Returns the part of it that affects later answers.
    fn memory(&self) -> Value;

    /// Restores the memory of another process, and the answers and notes that may be requested again.
    fn restore(&self, memory: Option<Value>, answers: Vec<KeptAnswer>, notes: Vec<KeyedNote>);

    /// Drops what [`HostMemory::restore`] brings back, because the episode is put to sleep.
    fn let_go(&self);

    /// Returns true if a player in this process would miss the episode.
    fn is_busy(&self) -> bool;
}

/// Data that any thread needs to play the episode.
#[derive(Debug)]
pub struct Stage {
    pub id: String,
    pub spec: EpisodeSpec,
    pub folder: RunFolder,
    pub metrics: Arc<Metrics>,
    pub status: SharedStatus,
    pub feed: LiveFeed,
    /// Place that the episode takes among the server's episodes.
    pub place: Mutex<Option<OwnedSemaphorePermit>>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
    /// Held by the thread that plays; one does at a time.
    pub turn: Mutex<()>,
}

/// Origin of a thread's session.
pub enum Opening {
    /// The episode begins.
    New { clock: Clock, started: oneshot::Sender<Result<Briefing, EpisodeError>> },
    /// The episode is brought back; `thinking` is the time since its policy was last answered.
    Again { thinking: Duration },
}

/// A session and the journal to which it is written.
struct Desk<'a> {
    stage: &'a Stage,
    session: PanicGuard,
    log: Option<Log>,
}

/// The journal of an episode that this process plays.
struct Log {
    file: JournalFile,
    lease: Lease,
    /// Memory that was written last.
    memory: Value,
}

/// Result of an episode, or the reason why it is not known.
type Outcome = Result<ResultReply, HostingError>;

/// Reason why the thread ended.
enum Left {
    /// The caller that asked for the end, and the reply it receives once the place is free.
    Closed(Option<(ReplySender<ResultReply>, Box<Outcome>)>),
    Asleep,
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

fn play(stage: &Stage, opening: Opening, mut inbox: mpsc::Receiver<Job>) {
    let turn = stage.turn.lock().unwrap_or_else(PoisonError::into_inner);
    let desk = match opening {
        Opening::New { clock, started } => match stage.begin(clock) {
            Ok((session, briefing)) => {
                // A caller that went away during the start has dropped the other end of the inbox, and
                // `work` returns.
                let _ = started.send(Ok(briefing));
                Desk { stage, session, log: None }
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
                    job.refuse(&why);
                }
                return;
            }
        },
    };
    let Left::Closed(told) = desk.work(inbox) else { return };
    stage.feed.close();
    // The place is freed before the caller receives the result, so that it can start the next episode.
    stage.place.lock().unwrap_or_else(PoisonError::into_inner).take();
    if let Some((reply, result)) = told {
        let _ = reply.send(*result);
    }
}

impl Stage {
    pub fn new(id: &str, spec: EpisodeSpec, surroundings: Surroundings, status: SharedStatus) -> Stage {
        let Surroundings { folder, place, metrics, memory, journals } = surroundings;
        Stage {
            id: id.into(),
            spec,
            folder,
            metrics,
            status,
            feed: LiveFeed::new(),
            place: Mutex::new(Some(place)),
            memory,
            journals,
            turn: Mutex::default(),
        }
    }

    /// Removes the journal of a sleeping episode, which will not be brought back.
    pub fn forget_journal(&self) -> Result<(), HostingError> {
        let Some(path) = self.journals.as_ref().and_then(|journals| journals.journal(&self.id)) else {
            return Ok(());
        };
        match std::fs::remove_file(&path) {
            Err(source) if source.kind() != std::io::ErrorKind::NotFound => {
                Err(HostingError::Journal { path, source })
            }
            _ => Ok(()),
        }
    }

    fn guarded(&self, session: Session) -> PanicGuard {
        PanicGuard::new(session, EpisodeMetrics::new(self.metrics.clone()))
    }

    fn onlookers(&self) -> Result<Box<FeedEnd>, HostingError> {
        self.feed.end().map(Box::new).ok_or(HostingError::EpisodeStopped)
    }

    fn begin(&self, clock: Clock) -> Result<(PanicGuard, Briefing), EpisodeError> {
        let mut session = Session::start_with_clock(&self.spec, Some(self.folder.clone()), clock)?;
        if let Some(feed) = self.feed.end() {
            session.set_onlookers(Box::new(feed));
        }
        let briefing = session.briefing();
        Ok((self.guarded(session), briefing))
    }

    /// Takes the lease and replays the journal.
    fn bring_back(&self, thinking: Duration) -> Result<Desk<'_>, HostingError> {
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
        // A recording that is complete is not written again.
        let is_written = entries.last().is_some_and(|entry| entry.ended.is_some())
            && self.folder.path.join(RESULT_FILE).exists();
        let session = Session::bring_back(BringBack {
            spec: self.spec.clone(),
            folder: (!is_written).then(|| self.folder.clone()),
            entries,
            clock: monotonic(),
            thinking,
            onlookers: self.onlookers()?,
        })?;
        let file = JournalFile::go_on(&path, reader, journals.durability).map_err(failed)?;
        let log = Log { file, lease, memory: memory.clone().unwrap_or_default() };
        self.memory.restore(memory, answers, notes);
        tracing::info!("brought back");
        let metrics = EpisodeMetrics::again(self.metrics.clone(), &session);
        let session = PanicGuard::again(session, metrics);
        self.status.update(&session);
        self.status.is_back();
        Ok(Desk { stage: self, session, log: Some(log) })
    }
}

impl Desk<'_> {
    /// Runs jobs until one asks for the end or for sleep, or until all senders are gone.
    fn work(mut self, mut inbox: mpsc::Receiver<Job>) -> Left {
        self.stage.status.update(&self.session);
        let mut asleep = false;
        while let Some(job) = inbox.blocking_recv() {
            match job {
                Job::Sleep if self.log.is_some() => {
                    let thinking = self.session.run(|session| session.thinking()).unwrap_or_default();
                    self.stage.status.fall_asleep(thinking);
                    // Jobs that have arrived by now are still done; later ones wake the episode up.
                    inbox.close();
                    asleep = true;
                }
                Job::Close { keep, reply } => return Left::Closed(Some((reply, Box::new(self.close(keep))))),
                job => self.do_job(job),
            }
        }
        if asleep {
            self.stage.memory.let_go();
            return Left::Asleep;
        }
        // Nobody is left to receive the result.
        let _ = self.close(true);
        Left::Closed(None)
    }

    /// Runs one job. An action stays done even if its reply cannot be sent because the caller has gone. A
    /// refusal that has no recipient is logged.
    fn do_job(&mut self, job: Job) {
        match job {
            Job::Call { operator, call, keyed, told, reply } => {
                let answer = self.session.run(|session| answer(session, operator.as_deref(), *call));
                let answer = told(answer.flatten());
                self.commit(keyed.as_ref().zip(answer.as_ref().ok()));
                let _ = reply.send(answer);
            }
            Job::ReadCommand { call, reply } => {
                let command = self.session.run(|session| Ok(session.read_command(*call)?)).flatten();
                self.commit(None);
                let _ = reply.send(command);
            }
            Job::Together { commands, keyed, told, reply } => {
                let answers = told(self.session.run(|session| together(session, commands)).flatten());
                let told = answers.as_deref().unwrap_or_default();
                self.commit(keyed.iter().zip(told).filter_map(|(keyed, told)| Some((keyed.as_ref()?, told))));
                let _ = reply.send(answers);
            }
            Job::KeepAnswer { keyed, answer, reply } => {
                self.commit([(&keyed, &*answer)]);
                let _ = reply.send(Ok(*answer));
            }
            Job::Note { operator, note, key, reply } => {
                let _ = reply.send(self.note(operator.as_deref(), *note, key));
            }
            Job::Refused { operator, call, reply } => {
                let kept = self.session.run(|session| refused(session, operator.as_deref(), *call));
                self.commit(None);
                let _ = reply.send(kept);
            }
            Job::Status { reply } => drop(reply.send(self.session.run(|session| standing(session)))),
            Job::Briefing { reply } => drop(reply.send(self.session.run(|session| session.briefing()))),
            Job::Watch { operator, reply } => {
                let view = self.session.run(|session| view(session, operator.as_deref()));
                self.commit(None);
                let _ = reply.send(view.flatten());
            }
            Job::Work(work) => {
                work(Ok((&mut self.session, &self.stage.status)));
                self.commit(None);
            }
            Job::EndIfAbandoned { idle } => {
                let goes_on = self.session.ended().is_none();
                let _ = self.session.run(|session| session.end_if_abandoned(idle));
                self.commit(None);
                if goes_on && self.session.ended().is_some() {
                    tracing::info!("abandoned, and ended");
                }
            }
            Job::End { reason } => {
                let _ = self.session.run(|session| session.end(reason));
                self.commit(None);
            }
            Job::BeginJournal { heading, reply } => drop(reply.send(self.begin_journal(&heading))),
            Job::Awake { reply } => drop(reply.send(Ok(()))),
            Job::Sleep | Job::Close { .. } => {}
        }
    }

    fn note(&mut self, operator: Option<&str>, note: Note, key: Option<String>) -> Result<(), HostingError> {
        let keyed = key.map(|key| KeyedNote { key, note: note.clone() });
        let kept = self.session.run(|session| Ok(session.note(operator, note)?)).flatten();
        self.commit_noted(None, keyed.filter(|_| kept.is_ok()));
        kept
    }

    /// Writes to the journal what has been done and the answers to calls with a key.
    fn commit<'a>(&mut self, answers: impl IntoIterator<Item = (&'a Keyed, &'a Answer)>) {
        self.commit_noted(answers, None);
    }

    /// Does the same as [`Desk::commit`], with a recorded note that came with a key.
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

    fn begin_journal(&mut self, heading: &Heading) -> Result<(), HostingError> {
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
                // After a panic there is nothing to keep.
                let _ = self.session.run(Session::keep_journal);
                self.log = Some(log);
                self.stage.status.durable.store(true, std::sync::atomic::Ordering::Relaxed);
            }
            Err(error) => {
                tracing::warn!(%error, "no journal; a server that is started again does not bring it back")
            }
        }
        Ok(())
    }

    /// Removes the journal.
    fn forget(&mut self) {
        self.stage.status.durable.store(false, std::sync::atomic::Ordering::Relaxed);
        if let Some(Log { file, .. }) = self.log.take()
            && let Err(error) = file.remove()
        {
            tracing::error!(%error, "the journal stays");
        }
    }

    fn close(mut self, keep: bool) -> Result<ResultReply, HostingError> {
        if !keep {
            self.forget();
        }
        let result = self.session.close();
        result.inspect(|result| drop(self.stage.status.result.set(result.clone())))
    }
}

fn answer(session: &mut Session, operator: Option<&str>, call: Call) -> Result<Answer, HostingError> {
    let reply = session.ask(operator, call)?;
    Ok(Answer::new(reply, session))
}

fn together(
    session: &mut Session,
    commands: Vec<tandem_episodes::OperatorCommand>,
) -> Result<Vec<Answer>, HostingError> {
    let replies = session.together(commands)?;
    Ok(replies.into_iter().map(|reply| Answer::new(reply, session)).collect())
}

fn refused(session: &mut Session, operator: Option<&str>, call: RefusedCall) {
    let RefusedCall { tool, arguments, problem } = call;
    session.refused_before(operator, &tool, &arguments, &problem);
}

fn view(session: &mut Session, operator: Option<&str>) -> Result<LiveView, HostingError> {
    match operator {
        Some(robot) => Ok(session.drivers_view(robot)?),
        None => Ok(session.live_view()),
    }
}

fn standing(session: &Session) -> Answer {
    let reply = ToolReply::Manage(ManageReply::GetStatus(session.status()));
    Answer::new(CallReply { reply, observation: None }, session)
}
