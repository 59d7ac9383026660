//! The thread that owns one episode's world. Calls reach it through a bounded channel, each with its own reply, and a call
//! whose caller has gone still finishes, is recorded and charged.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    time::Duration,
};

use tandem_episodes::{
    Called, Clock, EpisodeError, EpisodeSpec, Facts, OperatorCommand, RunFolder, Session, monotonic,
};
use tandem_tools_spec::{
    Asked, Briefing, Look, LookCall, ManageReply, ResultReply, Say, ToolCall, ToolReply,
};
use tokio::sync::{OwnedSemaphorePermit, mpsc, oneshot};

use super::{
    Answer, HostingError,
    guarded::Guarded,
    tally::Tally,
    work::{self, Made},
};
use crate::metrics::Metrics;

/// Calls that may wait for one episode. A policy has no use for more than one at a time; a few more are a burst.
const WAITING_CALLS: usize = 16;

/// The contact solver keeps large temporaries on the stack.
const STACK_BYTES: usize = 8 << 20;

enum Command {
    Make {
        made: Box<Made>,
        reply: oneshot::Sender<Result<Answer, HostingError>>,
    },
    Check(Box<Check>),
    Together {
        commands: Vec<OperatorCommand>,
        looks: Vec<Option<Look>>,
        reply: oneshot::Sender<Result<Vec<Answer>, HostingError>>,
    },
    Status {
        reply: oneshot::Sender<Result<Answer, HostingError>>,
    },
    Briefing {
        reply: oneshot::Sender<Result<Briefing, HostingError>>,
    },
    Facts {
        reply: oneshot::Sender<Result<Facts, HostingError>>,
    },
    EndIfAbandoned {
        idle: Duration,
    },
    Close {
        reply: oneshot::Sender<Closing>,
    },
}

/// Asks whether an operator's command could be executed.
struct Check {
    command: OperatorCommand,
    expected_step: Option<u32>,
    then: Option<Look>,
    reply: oneshot::Sender<Result<(), HostingError>>,
}

/// A running episode. Dropping the last handle ends the episode and closes its recording.
#[derive(Debug)]
pub struct EpisodeThread {
    commands: mpsc::Sender<Command>,
    news: Arc<News>,
    folder: PathBuf,
    steps_per_command: u32,
}

/// What the thread lets everybody know without being asked.
#[derive(Debug, Default)]
struct News {
    ended: AtomicBool,
    /// The first failure of the recording.
    recording_failed: OnceLock<String>,
    /// How long the policy has thought, in nanoseconds.
    thought: AtomicU64,
}

impl News {
    /// As `session` stands.
    fn spread(&self, session: &Guarded) {
        self.ended.store(session.ended(), Ordering::Relaxed);
        self.thought.store(session.thought().as_nanos() as u64, Ordering::Relaxed);
        if let Some(reason) = session.recording_failed() {
            self.recording_failed.get_or_init(|| reason.to_owned());
        }
    }
}

impl EpisodeThread {
    /// Makes the world on a thread of its own, runs the initial hold, and returns what the policy has to know. The permit
    /// is one of the places for live episodes and is given back when the thread ends.
    pub async fn start(
        id: &str,
        spec: EpisodeSpec,
        folder: RunFolder,
        permit: OwnedSemaphorePermit,
        metrics: Arc<Metrics>,
    ) -> Result<(EpisodeThread, Briefing), HostingError> {
        EpisodeThread::start_with_clock(id, spec, folder, permit, metrics, monotonic()).await
    }

    /// As [`EpisodeThread::start`], with the policy's wall clock read from `clock`.
    pub async fn start_with_clock(
        id: &str,
        spec: EpisodeSpec,
        folder: RunFolder,
        permit: OwnedSemaphorePermit,
        metrics: Arc<Metrics>,
        clock: Clock,
    ) -> Result<(EpisodeThread, Briefing), HostingError> {
        let (commands, inbox) = mpsc::channel(WAITING_CALLS);
        let (started, start) = oneshot::channel();
        let news = Arc::new(News::default());
        let (from_thread, name, path) = (news.clone(), id.to_owned(), folder.path.clone());
        let thread = move || {
            // Every line that is logged on this thread names the episode.
            let _named = tracing::info_span!("thread", episode = name).entered();
            match open_session(&spec, folder, clock) {
                Ok((session, briefing)) => {
                    // A caller that went away during the start has dropped the inbox's other end, and serve returns.
                    let _ = started.send(Ok(briefing));
                    let closed = serve(Guarded::new(session, Tally::new(metrics)), inbox, &from_thread);
                    // The place is free before the caller hears of the end, so that it can start the next episode.
                    drop(permit);
                    closed.answer();
                }
                Err(error) => drop(started.send(Err(error))),
            }
        };
        std::thread::Builder::new()
            .name(id.into())
            .stack_size(STACK_BYTES)
            .spawn(thread)
            .map_err(HostingError::Thread)?;
        let briefing = start.await.map_err(|_| HostingError::EpisodePanicked)??;
        let steps_per_command = briefing.status.budget.steps_per_command;
        Ok((EpisodeThread { commands, news, folder: path, steps_per_command }, briefing))
    }

    /// Runs a call and returns its reply.
    pub async fn call(&self, call: ToolCall) -> Result<Answer, HostingError> {
        self.ask(None, call.into()).await
    }

    /// As [`EpisodeThread::call`], with what programs ask for besides, and for the operator of a robot where each has one.
    pub async fn ask(&self, operator: Option<&str>, asked: Asked) -> Result<Answer, HostingError> {
        let Asked { call, formats, expected_step, then } = asked;
        let called = match call {
            ToolCall::Look(LookCall::Observe(observe)) => Called::look(Look { observe, formats }),
            call => Called::Tool(call),
        };
        self.make(Made { operator: operator.map(str::to_owned), called, expected_step, then }).await
    }

    /// Records what the operator of `robot` says.
    pub async fn say(&self, robot: &str, say: Say) -> Result<Answer, HostingError> {
        let called = Called::Say(say);
        self.make(Made { operator: Some(robot.into()), called, expected_step: None, then: None }).await
    }

    async fn make(&self, made: Made) -> Result<Answer, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(Command::Make { made: made.into(), reply })?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Whether an operator's command could be executed now, and what it wants to see then could be seen.
    pub async fn check(
        &self,
        command: OperatorCommand,
        expected_step: Option<u32>,
        then: Option<Look>,
    ) -> Result<(), HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(Command::Check(Check { command, expected_step, then, reply }.into()))?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Executes commands of several operators side by side. Returns an answer for each, with what each looks at then.
    pub async fn together(
        &self,
        commands: Vec<OperatorCommand>,
        looks: Vec<Option<Look>>,
    ) -> Result<Vec<Answer>, HostingError> {
        let (reply, answer) = oneshot::channel();
        // Callers wait for it already, so it waits for its turn.
        let together = Command::Together { commands, looks, reply };
        self.commands.send(together).await.map_err(|_| HostingError::EpisodeStopped)?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Where the episode stands, for those who look on: asking is no call of the policy's.
    pub async fn status(&self) -> Result<Answer, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(Command::Status { reply })?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// What has to be known to begin, as it stands now.
    pub async fn briefing(&self) -> Result<Briefing, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(Command::Briefing { reply })?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Where everything is and who touches what: for experts and scoring in this process, never for policies.
    pub fn facts_blocking(&self) -> Result<Facts, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(Command::Facts { reply })?;
        answer.blocking_recv().map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Ends the episode if its policy's clock has run out, or if it has made no call for as long as `idle`.
    pub fn end_if_abandoned(&self, idle: Duration) {
        // Where something waits already, nobody is gone, and the places to wait are for calls.
        if self.commands.capacity() == self.commands.max_capacity() {
            // An episode that has stopped meanwhile has ended.
            let _ = self.commands.try_send(Command::EndIfAbandoned { idle });
        }
    }

    /// Ends the episode after the calls already waiting, closes its recording and returns the result.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.commands.send(Command::Close { reply }).await.map_err(|_| HostingError::EpisodeStopped)?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Whether the episode takes no more commands.
    pub fn ended(&self) -> bool {
        self.news.ended.load(Ordering::Relaxed) || self.commands.is_closed()
    }

    /// How long the policy has thought, up to its last call.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.news.thought.load(Ordering::Relaxed))
    }

    /// Why the recording is not complete, if it is not.
    pub fn recording_failed(&self) -> Option<&str> {
        self.news.recording_failed.get().map(String::as_str)
    }

    /// The most control steps that one command may ask for.
    pub fn steps_per_command(&self) -> u32 {
        self.steps_per_command
    }

    /// Where the recording lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    fn send(&self, command: Command) -> Result<(), HostingError> {
        self.commands.try_send(command).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => HostingError::TooManyWaiting { limit: WAITING_CALLS },
            mpsc::error::TrySendError::Closed(_) => HostingError::EpisodeStopped,
        })
    }
}

fn open_session(
    spec: &EpisodeSpec,
    folder: RunFolder,
    clock: Clock,
) -> Result<(Session, Briefing), EpisodeError> {
    let session = Session::start_with_clock(spec, Some(folder), clock)?;
    let briefing = session.briefing();
    Ok((session, briefing))
}

/// Who asked for the end, and what they are to be told once the place is free.
struct Closed(Option<(oneshot::Sender<Closing>, Closing)>);

type Closing = Result<ResultReply, HostingError>;

impl Closed {
    fn answer(self) {
        if let Some((reply, result)) = self.0 {
            let _ = reply.send(result);
        }
    }
}

/// Answers commands until one asks for the end, or nobody is left who could send one.
fn serve(mut session: Guarded, mut inbox: mpsc::Receiver<Command>, news: &News) -> Closed {
    news.spread(&session);
    while let Some(command) = inbox.blocking_recv() {
        // A reply that cannot be sent means that the caller has gone. What was done stays done.
        match command {
            Command::Make { made, reply } => {
                let answer = session.run(|session| work::make(session, &made));
                news.spread(&session);
                let _ = reply.send(answer.and_then(|answer| answer));
            }
            Command::Check(check) => {
                let Check { command, expected_step, then, reply } = *check;
                let checked =
                    session.run(|session| work::check(session, &command, expected_step, then.as_ref()));
                news.spread(&session);
                let _ = reply.send(checked.and_then(|checked| checked));
            }
            Command::Together { commands, looks, reply } => {
                let answers = session.run(|session| work::together(session, commands, &looks));
                news.spread(&session);
                let _ = reply.send(answers.and_then(|answers| answers));
            }
            Command::Status { reply } => drop(reply.send(session.run(|session| status(session)))),
            Command::Briefing { reply } => drop(reply.send(session.run(|session| session.briefing()))),
            Command::Facts { reply } => drop(reply.send(session.run(|session| session.facts()))),
            Command::EndIfAbandoned { idle } => {
                // The log has the reason of a refusal.
                let _ = session.run(|session| session.end_if_abandoned(idle));
                news.spread(&session);
                if session.ended() {
                    tracing::info!("abandoned, and ended");
                }
            }
            Command::Close { reply } => return Closed(Some((reply, session.close()))),
        }
    }
    // Nobody is left who could be told.
    let _ = session.close();
    Closed(None)
}

fn status(session: &Session) -> Answer {
    Answer::new(ToolReply::Manage(ManageReply::GetStatus(session.status())), session)
}
