//! The thread that owns one episode's world. Calls reach it through a bounded channel, each with its own reply, and a call
//! whose caller has gone still finishes, is recorded and charged.

use std::{
    path::{Path, PathBuf},
    sync::{
        Arc, OnceLock,
        atomic::{AtomicU32, AtomicU64, Ordering},
    },
    time::Duration,
};

use tandem_episodes::{
    CallReply, Clock, EpisodeError, EpisodeSpec, Facts, OperatorCall, OperatorCommand, Picture, RunFolder,
    Session, TeamObservation, live::LiveView, monotonic,
};
use tandem_tools_spec::{
    Briefing, Call, EndReason, ExtraInformation, ManageReply, Note, Observe, ResultReply, ToolCall, ToolReply,
};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};

use super::{
    Answer, HostingError, RefusedCall,
    onlookers::{EveryStep, FeedEnd, LiveFeed, LiveWatch},
    panic_guard::{EpisodeMetrics, PanicGuard},
};
use crate::metrics::Metrics;

/// Calls that may wait for one episode. A policy has no use for more than one at a time; a few more are a burst.
pub const WAITING_CALLS: usize = 16;

/// The contact solver keeps large temporaries on the stack.
const STACK_BYTES: usize = 8 << 20;

/// What the thread does for somebody, all of it between two other jobs.
enum Job {
    Call {
        /// The robot whose operator calls; `None` where one policy directs all.
        operator: Option<String>,
        call: Box<Call>,
        reply: ReplySender<Answer>,
    },
    ReadCommand {
        call: Box<OperatorCall>,
        reply: ReplySender<OperatorCommand>,
    },
    Together {
        commands: Vec<OperatorCommand>,
        reply: ReplySender<Vec<Answer>>,
    },
    Note {
        operator: Option<String>,
        note: Box<Note>,
        reply: ReplySender<()>,
    },
    /// Keeps a call that was refused on its way here.
    Refused {
        operator: Option<String>,
        call: Box<RefusedCall>,
        reply: ReplySender<()>,
    },
    Status {
        reply: ReplySender<Answer>,
    },
    Briefing {
        reply: ReplySender<Briefing>,
    },
    /// For experts, scoring and clients of policies in this process.
    Work(Work),
    EndIfAbandoned {
        idle: Duration,
    },
    End {
        reason: EndReason,
    },
    Watch {
        /// The operator of this robot looks on, which is recorded.
        operator: Option<String>,
        reply: ReplySender<LiveView>,
    },
    Close {
        reply: ReplySender<ResultReply>,
    },
}

type Work = Box<dyn FnOnce(&mut PanicGuard, &SharedStatus) + Send>;
type ReplySender<T> = oneshot::Sender<Result<T, HostingError>>;

/// A running episode. Dropping the last handle ends the episode and closes its recording.
#[derive(Debug)]
pub struct EpisodeThread {
    jobs: mpsc::Sender<Job>,
    status: Arc<SharedStatus>,
    folder: PathBuf,
    spec: Arc<EpisodeSpec>,
    robots: Vec<String>,
    steps_per_command: u32,
    feed: Arc<LiveFeed>,
    /// Those who begin to look on wait here, so that many of them take no place of calls.
    looking: Semaphore,
}

/// What the thread lets everybody know without being asked.
#[derive(Debug, Default)]
struct SharedStatus {
    /// Why the episode takes no more commands.
    ended: OnceLock<EndReason>,
    env_steps: AtomicU32,
    /// The first failure of the recording.
    recording_failed: OnceLock<String>,
    /// How long the policy has thought, in nanoseconds.
    thought: AtomicU64,
    /// What the episode came to, once it has been closed.
    result: OnceLock<ResultReply>,
}

impl SharedStatus {
    /// Takes over how `session` stands.
    fn update(&self, session: &PanicGuard) {
        if let Some(reason) = session.ended() {
            self.ended.get_or_init(|| reason);
        }
        if let Some(env_steps) = session.env_steps() {
            self.env_steps.store(env_steps, Ordering::Relaxed);
        }
        if let Some(thought) = session.thought() {
            self.thought.store(thought.as_nanos() as u64, Ordering::Relaxed);
        }
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
        let (jobs, inbox) = mpsc::channel(WAITING_CALLS);
        let (started, start) = oneshot::channel();
        let status = Arc::new(SharedStatus::default());
        let spec = Arc::new(spec);
        let played = spec.clone();
        let (feed, feed_end) = LiveFeed::new();
        let feed = Arc::new(feed);
        let fed = feed.clone();
        let (from_thread, name, path) = (status.clone(), id.to_owned(), folder.path.clone());
        let thread = move || {
            // Every line that is logged on this thread names the episode.
            let _named = tracing::info_span!("thread", episode = name).entered();
            match open_session(&played, folder, clock, feed_end) {
                Ok((session, briefing)) => {
                    // A caller that went away during the start has dropped the inbox's other end, and serve returns.
                    let _ = started.send(Ok(briefing));
                    let guarded = PanicGuard::new(session, EpisodeMetrics::new(metrics));
                    let closed = serve(guarded, inbox, &from_thread);
                    fed.close();
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
        status.env_steps.fetch_max(briefing.status.env_steps, Ordering::Relaxed);
        let steps_per_command = briefing.status.budget.steps_per_command;
        let robots = briefing.robots.iter().map(|robot| robot.robot.clone()).collect();
        let looking = Semaphore::new(1);
        let thread =
            EpisodeThread { jobs, status, folder: path, spec, robots, steps_per_command, feed, looking };
        Ok((thread, briefing))
    }

    /// Runs a call of the policy that directs all robots and returns its reply.
    pub async fn call(&self, tool: ToolCall) -> Result<Answer, HostingError> {
        self.ask(None, tool.into()).await
    }

    /// As [`EpisodeThread::call`], with all that may go with a call, and for the operator of a robot where each has one.
    pub async fn ask(&self, operator: Option<&str>, call: Call) -> Result<Answer, HostingError> {
        let (operator, call) = (operator.map(str::to_owned), Box::new(call));
        self.do_job(|reply| Job::Call { operator, call, reply }).await
    }

    /// Reads an operator's command: what cannot be executed, and what could not be seen afterwards, is refused.
    pub async fn read_command(&self, call: OperatorCall) -> Result<OperatorCommand, HostingError> {
        self.do_job(|reply| Job::ReadCommand { call: call.into(), reply }).await
    }

    /// Executes commands of several operators side by side. Returns an answer for each, with what each looks at then.
    pub async fn together(&self, commands: Vec<OperatorCommand>) -> Result<Vec<Answer>, HostingError> {
        // Callers wait for it already, so it waits for its turn.
        self.do_job_in_turn(|reply| Job::Together { commands, reply }).await
    }

    /// Keeps a note of the policy that directs all robots, or of the operator of one.
    pub async fn note(&self, operator: Option<&str>, note: Note) -> Result<(), HostingError> {
        let (operator, note) = (operator.map(str::to_owned), Box::new(note));
        self.do_job(|reply| Job::Note { operator, note, reply }).await
    }

    /// Keeps a call that was refused before it came here, after those that its caller made before. Nobody is told where it cannot be
    /// kept.
    pub async fn refused(&self, operator: Option<&str>, call: RefusedCall) {
        let (operator, call) = (operator.map(str::to_owned), Box::new(call));
        let _ = self.do_job_in_turn(|reply| Job::Refused { operator, call, reply }).await;
    }

    /// Where the episode stands, for those who look on: asking is no call of the policy's.
    pub async fn status(&self) -> Result<Answer, HostingError> {
        self.do_job(|reply| Job::Status { reply }).await
    }

    /// What has to be known to begin, as it stands now.
    pub async fn briefing(&self) -> Result<Briefing, HostingError> {
        self.do_job(|reply| Job::Briefing { reply }).await
    }

    /// How the episode stands, and what happens from now on, for who looks on: no call of the policy's.
    pub async fn watch(&self) -> Result<LiveWatch, HostingError> {
        self.watch_as(None).await
    }

    /// As [`EpisodeThread::watch`], for the person who drives `robot` and is told every step. It sees what no policy may know; that is
    /// recorded, and results name it.
    pub async fn watch_driving(&self, robot: &str) -> Result<(LiveWatch, EveryStep), HostingError> {
        Ok((self.watch_as(Some(robot.into())).await?, self.feed.every_step()))
    }

    async fn watch_as(&self, operator: Option<String>) -> Result<LiveWatch, HostingError> {
        // Listening comes first, so that nothing is missed between the two.
        let events = self.feed.subscribe().ok_or(HostingError::EpisodeStopped)?;
        let _turn = self.looking.acquire().await.map_err(|_| HostingError::EpisodeStopped)?;
        let view = self.do_job_in_turn(|reply| Job::Watch { operator, reply }).await?;
        Ok(LiveWatch { view, events })
    }

    /// Where everything is and who touches what: for experts and scoring in this process, never for policies.
    pub fn facts_blocking(&self) -> Result<Facts, HostingError> {
        self.work_blocking(|session| Ok(session.facts()))
    }

    /// A look through the robots, as it was drawn, for a policy that is asked from this process and `shown` this of what policies are
    /// not shown as a rule; results name it.
    pub fn look_blocking(
        &self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, HostingError> {
        let (observe, shown) = (observe.clone(), shown.to_vec());
        self.work_blocking(move |session| Ok(session.observe(&observe, &shown)?))
    }

    /// The room, seen from where no robot stands, for the same policies.
    pub fn room_blocking(&self) -> Result<Picture, HostingError> {
        self.work_blocking(|session| Ok(session.third_person()))
    }

    /// Ends the episode if its policy's clock has run out, or if it has made no call for as long as `idle`.
    pub fn end_if_abandoned(&self, idle: Duration) {
        // Where something waits already, nobody is gone, and the places to wait are for calls.
        if self.jobs.capacity() == self.jobs.max_capacity() {
            // An episode that has stopped meanwhile has ended.
            let _ = self.jobs.try_send(Job::EndIfAbandoned { idle });
        }
    }

    /// Ends the episode for a reason that lies outside it, after the calls already waiting, unless it has ended by then. Not for
    /// threads that run futures: it waits for a place among the jobs.
    pub fn end_blocking(&self, reason: EndReason) {
        // An episode that has stopped meanwhile has ended.
        let _ = self.jobs.blocking_send(Job::End { reason });
    }

    /// Ends the episode after the calls already waiting, closes its recording and returns the result.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        self.do_job_in_turn(|reply| Job::Close { reply }).await
    }

    /// Whether the episode takes no more commands.
    pub fn ended(&self) -> bool {
        self.end_reason().is_some() || self.jobs.is_closed()
    }

    /// Why the episode takes no more commands, as far as its last call has shown.
    pub fn end_reason(&self) -> Option<EndReason> {
        self.status.ended.get().copied()
    }

    /// Control steps executed up to the last call, the initial hold included.
    pub fn env_steps(&self) -> u32 {
        self.status.env_steps.load(Ordering::Relaxed)
    }

    /// What is played.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.spec
    }

    /// The robots of the episode, in order.
    pub fn robots(&self) -> &[String] {
        &self.robots
    }

    /// How long the policy has thought, up to its last call.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.status.thought.load(Ordering::Relaxed))
    }

    /// What the episode came to, with nothing withheld; from when it has been closed.
    pub fn result(&self) -> Option<&ResultReply> {
        self.status.result.get()
    }

    /// Why the recording is not complete, if it is not.
    pub fn recording_failed(&self) -> Option<&str> {
        self.status.recording_failed.get().map(String::as_str)
    }

    /// The most control steps that one command may ask for.
    pub fn steps_per_command(&self) -> u32 {
        self.steps_per_command
    }

    /// Where the recording lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// Has the thread do a job, unless too many wait already.
    async fn do_job<T>(&self, job: impl FnOnce(ReplySender<T>) -> Job) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(job(reply))?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Does something with the session, unless too many wait already; for threads that run no futures.
    fn work_blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Session) -> Result<T, HostingError> + Send + 'static,
    ) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel::<Result<T, HostingError>>();
        self.send(Job::Work(Box::new(move |session, status| {
            let done = session.run(work).flatten();
            status.update(session);
            // Who asked may have gone.
            let _ = reply.send(done);
        })))?;
        answer.blocking_recv().map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Has the thread do a job, however many wait.
    async fn do_job_in_turn<T>(&self, job: impl FnOnce(ReplySender<T>) -> Job) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.jobs.send(job(reply)).await.map_err(|_| HostingError::EpisodeStopped)?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    fn send(&self, job: Job) -> Result<(), HostingError> {
        self.jobs.try_send(job).map_err(|error| match error {
            mpsc::error::TrySendError::Full(_) => HostingError::TooManyWaiting { limit: WAITING_CALLS },
            mpsc::error::TrySendError::Closed(_) => HostingError::EpisodeStopped,
        })
    }
}

fn open_session(
    spec: &EpisodeSpec,
    folder: RunFolder,
    clock: Clock,
    feed: FeedEnd,
) -> Result<(Session, Briefing), EpisodeError> {
    let mut session = Session::start_with_clock(spec, Some(folder), clock)?;
    session.set_onlookers(Box::new(feed));
    let briefing = session.briefing();
    Ok((session, briefing))
}

/// Who asked for the end, and what they are to be told once the place is free.
struct Closed(Option<(ReplySender<ResultReply>, Result<ResultReply, HostingError>)>);

impl Closed {
    fn answer(self) {
        if let Some((reply, result)) = self.0 {
            let _ = reply.send(result);
        }
    }
}

/// Does jobs until one asks for the end, or nobody is left who could send one.
fn serve(mut session: PanicGuard, mut inbox: mpsc::Receiver<Job>, status: &SharedStatus) -> Closed {
    status.update(&session);
    while let Some(job) = inbox.blocking_recv() {
        // A reply that cannot be sent means that the caller has gone. What was done stays done.
        match job {
            Job::Call { operator, call, reply } => {
                let answer = session.run(|session| answer(session, operator.as_deref(), *call));
                status.update(&session);
                let _ = reply.send(answer.flatten());
            }
            Job::ReadCommand { call, reply } => {
                let command = session.run(|session| Ok(session.read_command(*call)?));
                status.update(&session);
                let _ = reply.send(command.flatten());
            }
            Job::Together { commands, reply } => {
                let answers = session.run(|session| together(session, commands));
                status.update(&session);
                let _ = reply.send(answers.flatten());
            }
            Job::Note { operator, note, reply } => {
                let kept = session.run(|session| Ok(session.note(operator.as_deref(), *note)?));
                status.update(&session);
                let _ = reply.send(kept.flatten());
            }
            Job::Refused { operator, call, reply } => {
                let RefusedCall { tool, arguments, problem } = *call;
                let kept = session
                    .run(|session| session.refused_before(operator.as_deref(), &tool, &arguments, &problem));
                let _ = reply.send(kept);
            }
            Job::Status { reply } => drop(reply.send(session.run(|session| standing(session)))),
            Job::Briefing { reply } => drop(reply.send(session.run(|session| session.briefing()))),
            Job::Watch { operator, reply } => {
                let view = session.run(|session| view(session, operator.as_deref()));
                status.update(&session);
                let _ = reply.send(view.flatten());
            }
            Job::Work(work) => work(&mut session, status),
            Job::EndIfAbandoned { idle } => {
                // The log has the reason of a refusal.
                let _ = session.run(|session| session.end_if_abandoned(idle));
                status.update(&session);
                if session.ended().is_some() {
                    tracing::info!("abandoned, and ended");
                }
            }
            Job::End { reason } => {
                // The log has the reason of a refusal.
                let _ = session.run(|session| session.end(reason));
                status.update(&session);
            }
            Job::Close { reply } => return Closed(Some((reply, close(session, status)))),
        }
    }
    // Nobody is left who could be told.
    let _ = close(session, status);
    Closed(None)
}

fn close(session: PanicGuard, status: &SharedStatus) -> Result<ResultReply, HostingError> {
    session.close().inspect(|result| drop(status.result.set(result.clone())))
}

fn answer(session: &mut Session, operator: Option<&str>, call: Call) -> Result<Answer, HostingError> {
    let reply = session.ask(operator, call)?;
    Ok(Answer::new(reply, session))
}

fn together(session: &mut Session, commands: Vec<OperatorCommand>) -> Result<Vec<Answer>, HostingError> {
    let replies = session.together(commands)?;
    Ok(replies.into_iter().map(|reply| Answer::new(reply, session)).collect())
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
