//! The thread that owns one episode's world. Calls reach it through a bounded channel, each with its own reply,
//! and a call whose caller has gone still finishes, is recorded and charged.

mod job;
mod onlookers;
mod panic_guard;
mod status;
mod work;

use std::{
    path::Path,
    sync::{Arc, Mutex, MutexGuard, PoisonError, atomic::Ordering},
    time::Duration,
};

use tandem_episodes::{
    Clock, EpisodeSpec, Facts, JournalEntry, OperatorCall, OperatorCommand, Picture, PlanAdvance, PlanRun,
    RunFolder, Session, TeamObservation, monotonic,
};
use tandem_tools_spec::{
    Briefing, Call, EndReason, ExtraInformation, Note, Observe, PlanCall, PlanReply, ResultReply, ToolCall,
};
use tokio::sync::{OwnedSemaphorePermit, Semaphore, mpsc, oneshot};

use super::{
    Answer, HostingError, RefusedCall,
    durable::{Heading, Keyed, LiveFolder},
};
use crate::metrics::Metrics;
pub use job::Tell;
use job::{Job, ReplySender};
use onlookers::EveryStep;
pub use onlookers::LiveWatch;
pub use panic_guard::{EpisodeMetrics, PanicGuard};
use status::SharedStatus;
pub use work::HostMemory;
use work::{Opening, Stage};

/// Calls that may wait for one episode. A policy has no use for more than one at a time; a few more are a
/// burst.
pub const WAITING_CALLS: usize = 16;

/// An episode. Its thread ends while it sleeps, and whatever is asked of it wakes it up. Dropping the last
/// handle closes its recording.
#[derive(Debug)]
pub struct EpisodeThread {
    jobs: Mutex<mpsc::Sender<Job>>,
    stage: Arc<Stage>,
    robots: Vec<String>,
    steps_per_command: u32,
    /// Those who begin to look on wait here, so that many of them take no place of calls.
    looking: Semaphore,
}

/// What an episode is played in.
#[derive(Debug)]
pub struct Surroundings {
    pub folder: RunFolder,
    /// One of the places for episodes, which is given back when it is closed.
    pub place: OwnedSemaphorePermit,
    pub metrics: Arc<Metrics>,
    pub memory: Arc<dyn HostMemory>,
    /// Where journals are, if it is to have one.
    pub journals: Option<LiveFolder>,
}

impl EpisodeThread {
    /// Makes the world on a thread of its own, runs the initial hold, and returns what the policy has to know.
    pub async fn start(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
    ) -> Result<(EpisodeThread, Briefing), HostingError> {
        EpisodeThread::start_with_clock(id, spec, surroundings, monotonic()).await
    }

    /// As [`EpisodeThread::start`], with the policy's wall clock read from `clock`.
    pub async fn start_with_clock(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
        clock: Clock,
    ) -> Result<(EpisodeThread, Briefing), HostingError> {
        let (jobs, inbox) = mpsc::channel(WAITING_CALLS);
        let (started, start) = oneshot::channel();
        let stage = Arc::new(Stage::new(id, spec, surroundings, SharedStatus::default()));
        work::spawn(stage.clone(), Opening::New { clock, started }, inbox)?;
        let briefing = start.await.map_err(|_| HostingError::EpisodePanicked)??;
        stage.status.reach(briefing.status.env_steps);
        Ok((EpisodeThread::on(stage, jobs, &briefing), briefing))
    }

    /// An episode that sleeps where `entries` of its journal have brought it, and began as `briefing` has it.
    pub fn asleep<'a>(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
        briefing: &Briefing,
        entries: impl Iterator<Item = &'a JournalEntry>,
    ) -> EpisodeThread {
        let status = SharedStatus::asleep(entries, briefing.status.env_steps);
        let stage = Arc::new(Stage::new(id, spec, surroundings, status));
        // Nobody receives, so that the first job wakes it up.
        EpisodeThread::on(stage, mpsc::channel(1).0, briefing)
    }

    fn on(stage: Arc<Stage>, jobs: mpsc::Sender<Job>, briefing: &Briefing) -> EpisodeThread {
        EpisodeThread {
            jobs: Mutex::new(jobs),
            stage,
            robots: briefing.robots.iter().map(|robot| robot.robot.clone()).collect(),
            steps_per_command: briefing.status.budget.steps_per_command,
            looking: Semaphore::new(1),
        }
    }

    /// From now on writes what is done into a journal, from which a later process can bring the episode back.
    pub async fn begin_journal(&self, heading: Heading) -> Result<(), HostingError> {
        let heading = Box::new(heading);
        self.do_job_in_turn(|reply| Job::BeginJournal { heading, reply }).await
    }

    /// Returns once the episode is there, wherever it has been.
    pub async fn awake(&self) -> Result<(), HostingError> {
        // It is not enough that somebody has woken it up: what is answered already has to be known first.
        match self.stage.status.is_there() {
            true => Ok(()),
            false => self.do_job_in_turn(|reply| Job::Awake { reply }).await,
        }
    }

    /// Puts the episode aside, if it can be brought back and nobody would notice.
    pub fn put_aside(&self) {
        if self.may_sleep() {
            let jobs = lock(&self.jobs);
            if jobs.capacity() == jobs.max_capacity() {
                // One that has stopped meanwhile needs no memory either.
                let _ = jobs.try_send(Job::Sleep);
            }
        }
    }

    /// Whether it could be put aside.
    pub fn may_sleep(&self) -> bool {
        let Stage { status, feed, memory, .. } = &*self.stage;
        status.durable.load(Ordering::Relaxed)
            && status.sleep().is_none()
            && !feed.is_watched()
            && !memory.is_busy()
    }

    /// Whether it is put aside.
    pub fn sleeps(&self) -> bool {
        self.stage.status.sleep().is_some()
    }

    /// How long nobody has asked it for anything.
    pub fn idle(&self) -> Duration {
        self.stage.status.idle()
    }

    /// Runs a call of the policy that directs all robots and returns its reply.
    pub async fn call(&self, tool: ToolCall) -> Result<Answer, HostingError> {
        self.ask(None, tool.into(), None, Box::new(|answer| answer)).await
    }

    /// As [`EpisodeThread::call`], with all that may go with a call, and for the operator of a robot where each
    /// has one. What `told` makes of the answer is told, and kept for a call with a key.
    pub async fn ask(
        &self,
        operator: Option<&str>,
        call: Call,
        keyed: Option<Keyed>,
        told: Tell<Answer>,
    ) -> Result<Answer, HostingError> {
        let (operator, call) = (operator.map(str::to_owned), Box::new(call));
        self.do_job(|reply| Job::Call { operator, call, keyed, told, reply }).await
    }

    /// Keeps an answer that was made of several for who asks again.
    pub async fn keep_answer(&self, keyed: Keyed, answer: Answer) -> Result<Answer, HostingError> {
        let answer = Box::new(answer);
        self.do_job_in_turn(|reply| Job::KeepAnswer { keyed, answer, reply }).await
    }

    /// Reads an operator's command: what cannot be executed, and what could not be seen afterwards, is refused.
    pub async fn read_command(&self, call: OperatorCall) -> Result<OperatorCommand, HostingError> {
        self.do_job(|reply| Job::ReadCommand { call: call.into(), reply }).await
    }

    /// Executes commands of several operators side by side. Returns an answer for each, with what each looks at
    /// then, as `told` has it.
    pub async fn together(
        &self,
        commands: Vec<(OperatorCommand, Option<Keyed>)>,
        told: Tell<Vec<Answer>>,
    ) -> Result<Vec<Answer>, HostingError> {
        let (commands, keyed) = commands.into_iter().unzip();
        // Callers wait for it already, so it waits for its turn.
        self.do_job_in_turn(|reply| Job::Together { commands, keyed, told, reply }).await
    }

    /// Keeps a note of the policy that directs all robots, or of the operator of one.
    pub async fn note(
        &self,
        operator: Option<&str>,
        note: Note,
        key: Option<String>,
    ) -> Result<(), HostingError> {
        let (operator, note) = (operator.map(str::to_owned), Box::new(note));
        self.do_job(|reply| Job::Note { operator, note, key, reply }).await
    }

    /// Keeps a call that was refused before it came here, after those that its caller made before. Nobody is
    /// told where it cannot be kept.
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

    /// As [`EpisodeThread::watch`], for the person who drives `robot` and is told every step. It sees what no
    /// policy may know; that is recorded, and results name it.
    pub async fn watch_driving(&self, robot: &str) -> Result<(LiveWatch, EveryStep), HostingError> {
        Ok((self.watch_as(Some(robot.into())).await?, self.stage.feed.every_step()))
    }

    async fn watch_as(&self, operator: Option<String>) -> Result<LiveWatch, HostingError> {
        // Listening comes first, so that nothing is missed between the two.
        let events = self.stage.feed.subscribe().ok_or(HostingError::EpisodeStopped)?;
        let _turn = self.looking.acquire().await.map_err(|_| HostingError::EpisodeStopped)?;
        let view = self.do_job_in_turn(|reply| Job::Watch { operator, reply }).await?;
        Ok(LiveWatch { view, events })
    }

    /// Where everything is and who touches what: for experts and scoring in this process, never for policies.
    pub fn facts_blocking(&self) -> Result<Facts, HostingError> {
        self.work_blocking(|session| Ok(session.facts()))
    }

    /// A look through the robots, as it was drawn, for a policy that is asked from this process and `shown`
    /// this of what policies are not shown as a rule; results name it.
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
        match self.stage.status.sleep() {
            Some(sleep) if sleep.thinking() < idle => {}
            // An episode that has stopped meanwhile has ended.
            Some(_) => drop(self.send(Job::EndIfAbandoned { idle })),
            None => {
                let jobs = lock(&self.jobs);
                // Where something waits already, nobody is gone, and the places to wait are for calls.
                if jobs.capacity() == jobs.max_capacity() {
                    let _ = jobs.try_send(Job::EndIfAbandoned { idle });
                }
            }
        }
    }

    /// Ends the episode for a reason that lies outside it, after the calls already waiting, unless it has ended
    /// by then. Not for threads that run futures: it waits for a place among the jobs.
    pub fn end_blocking(&self, reason: EndReason) {
        // An episode that has stopped meanwhile has ended.
        if let Ok(jobs) = self.sender() {
            let _ = jobs.blocking_send(Job::End { reason });
        }
    }

    /// Ends the episode after the calls already waiting, closes its recording and returns the result.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        self.do_job_in_turn(|reply| Job::Close { keep: false, reply }).await
    }

    /// As [`EpisodeThread::close`], of an episode that goes on where it is brought back.
    pub async fn leave(&self) -> Result<ResultReply, HostingError> {
        self.do_job_in_turn(|reply| Job::Close { keep: true, reply }).await
    }

    /// As [`EpisodeThread::close`], of an episode that has ended and whose result nobody asks for.
    pub async fn end_for_good(&self) -> Result<(), HostingError> {
        match self.sleeps() {
            true => self.stage.forget_journal(),
            false => self.close().await.map(drop),
        }
    }

    /// Whether the episode takes no more commands.
    pub fn ended(&self) -> bool {
        self.end_reason().is_some() || (!self.sleeps() && lock(&self.jobs).is_closed())
    }

    /// Why the episode takes no more commands, as far as its last call has shown.
    pub fn end_reason(&self) -> Option<EndReason> {
        self.stage.status.ended.get().copied()
    }

    /// Control steps executed up to the last call, the initial hold included.
    pub fn env_steps(&self) -> u32 {
        self.stage.status.env_steps()
    }

    /// What is played.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.stage.spec
    }

    /// The robots of the episode, in order.
    pub fn robots(&self) -> &[String] {
        &self.robots
    }

    /// How long the policy has thought, up to its last call.
    pub fn thought(&self) -> Duration {
        self.stage.status.thought()
    }

    /// What the episode came to, with nothing withheld; from when it has been closed.
    pub fn result(&self) -> Option<&ResultReply> {
        self.stage.status.result.get()
    }

    /// Why the recording is not complete, if it is not.
    pub fn recording_failed(&self) -> Option<&str> {
        self.stage.status.recording_failed.get().map(String::as_str)
    }

    /// The most control steps that one command may ask for.
    pub fn steps_per_command(&self) -> u32 {
        self.steps_per_command
    }

    /// Where the recording lies.
    pub fn folder(&self) -> &Path {
        &self.stage.folder.path
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
        let (reply, answer) = oneshot::channel();
        self.send(work_job(work, reply))?;
        answer.blocking_recv().map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Does something with the session in its turn.
    async fn work<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Session) -> Result<T, HostingError> + Send + 'static,
    ) -> Result<T, HostingError> {
        self.do_job_in_turn(|reply| work_job(work, reply)).await
    }

    /// Begins a plan of the operator `own`, which is refused if one of its commands could not be carried out.
    pub async fn begin_plan(&self, own: OperatorCall, plan: PlanCall) -> Result<PlanRun, HostingError> {
        self.work(move |session| Ok(session.begin_plan(&own, &plan)?)).await
    }

    /// Returns the plan with its next command.
    pub async fn advance_plan(&self, mut run: PlanRun) -> Result<(PlanRun, PlanAdvance), HostingError> {
        self.work(move |session| {
            let next = run.advance(session);
            Ok((run, next))
        })
        .await
    }

    /// Returns the reply to an operator's plan that goes no further, and the step that the episode is at.
    pub async fn end_plan(
        &self,
        call: Call,
        run: PlanRun,
        stopped: Option<String>,
    ) -> Result<(PlanReply, u32), HostingError> {
        self.work(move |session| Ok((session.end_plan(&call, run, stopped)?, session.env_steps()))).await
    }

    /// Has the thread do a job, however many wait.
    async fn do_job_in_turn<T>(&self, job: impl FnOnce(ReplySender<T>) -> Job) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel();
        let mut job = job(reply);
        // It may fall asleep between the two.
        while let Err(mpsc::error::SendError(unsent)) = self.sender()?.send(job).await {
            job = unsent;
        }
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    fn send(&self, mut job: Job) -> Result<(), HostingError> {
        loop {
            job = match self.sender()?.try_send(job) {
                Ok(()) => return Ok(()),
                Err(mpsc::error::TrySendError::Full(_)) => {
                    return Err(HostingError::TooManyWaiting { limit: WAITING_CALLS });
                }
                Err(mpsc::error::TrySendError::Closed(unsent)) => unsent,
            };
        }
    }

    /// Where jobs go: to the thread, which is started where the episode sleeps.
    fn sender(&self) -> Result<mpsc::Sender<Job>, HostingError> {
        self.stage.status.is_used();
        let mut jobs = lock(&self.jobs);
        if jobs.is_closed() {
            let sleep = self.stage.status.wake_up().ok_or(HostingError::EpisodeStopped)?;
            let (awake, inbox) = mpsc::channel(WAITING_CALLS);
            let opening = Opening::Again { thinking: sleep.thinking() };
            if let Err(error) = work::spawn(self.stage.clone(), opening, inbox) {
                self.stage.status.sleep_on(sleep);
                return Err(error);
            }
            *jobs = awake;
        }
        Ok(jobs.clone())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    // Nothing panics while it holds the lock.
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes a job of `work`, the outcome of which goes to `reply`.
fn work_job<T: Send + 'static>(
    work: impl FnOnce(&mut Session) -> Result<T, HostingError> + Send + 'static,
    reply: ReplySender<T>,
) -> Job {
    Job::Work(Box::new(move |on| {
        let done = on.and_then(|(session, status)| {
            let done = session.run(work).flatten();
            status.update(session);
            done
        });
        // The caller may have gone.
        let _ = reply.send(done);
    }))
}
