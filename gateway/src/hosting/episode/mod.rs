//! The thread that owns the world of one episode.
//!
//! Calls reach it through a bounded channel, each with its own reply. A call whose caller has gone still
//! finishes, is recorded and charged.

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

/// Maximum number of calls that may wait for one episode. A policy needs one at a time; a few more absorb
/// a burst.
pub const WAITING_CALLS: usize = 16;

/// An episode. Its thread ends while the episode sleeps, and any request wakes it up. Dropping the last
/// handle closes its recording.
#[derive(Debug)]
pub struct EpisodeThread {
    jobs: Mutex<mpsc::Sender<Job>>,
    stage: Arc<Stage>,
    robots: Vec<String>,
    steps_per_command: u32,
    /// Limits the watchers that are joining at once, so that they do not use up the places for calls.
    looking: Semaphore,
}

/// Environment in which an episode is played.
#[derive(Debug)]
pub struct Surroundings {
    pub folder: RunFolder,
    /// One of the server's places for episodes, released when the episode is closed.
    pub place: OwnedSemaphorePermit,
    pub metrics: Arc<Metrics>,
    pub memory: Arc<dyn HostMemory>,
    /// Folder of the journals; `None` for an episode without a journal.
    pub journals: Option<LiveFolder>,
}

impl EpisodeThread {
    /// Creates the world on a thread of its own, runs the initial hold and returns the policy's briefing.
    pub async fn start(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
    ) -> Result<(EpisodeThread, Briefing), HostingError> {
        EpisodeThread::start_with_clock(id, spec, surroundings, monotonic()).await
    }

    /// Does the same as [`EpisodeThread::start`], with the policy's wall clock read from `clock`.
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

    /// Creates an episode that sleeps after the given `entries` of its journal and began with `briefing`.
    pub fn asleep<'a>(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
        briefing: &Briefing,
        entries: impl Iterator<Item = &'a JournalEntry>,
    ) -> EpisodeThread {
        let status = SharedStatus::asleep(entries, briefing.status.env_steps);
        let stage = Arc::new(Stage::new(id, spec, surroundings, status));
        // The channel has no receiver, so the first job wakes the episode up.
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

    /// Starts to write a journal from which a later process can bring the episode back.
    pub async fn begin_journal(&self, heading: Heading) -> Result<(), HostingError> {
        let heading = Box::new(heading);
        self.do_job_in_turn(|reply| Job::BeginJournal { heading, reply }).await
    }

    /// Wakes the episode up if necessary and returns once it is there.
    pub async fn awake(&self) -> Result<(), HostingError> {
        // Being woken up is not enough: the answers of the journal have to be restored first.
        match self.stage.status.is_there() {
            true => Ok(()),
            false => self.do_job_in_turn(|reply| Job::Awake { reply }).await,
        }
    }

    /// Puts the episode to sleep if it can be brought back and nobody would notice.
    pub fn put_aside(&self) {
        if self.may_sleep() {
            let jobs = lock(&self.jobs);
            if jobs.capacity() == jobs.max_capacity() {
                // An episode that has stopped meanwhile needs no memory either.
                let _ = jobs.try_send(Job::Sleep);
            }
        }
    }

    /// Returns true if the episode could be put to sleep.
    pub fn may_sleep(&self) -> bool {
        let Stage { status, feed, memory, .. } = &*self.stage;
        status.durable.load(Ordering::Relaxed)
            && status.sleep().is_none()
            && !feed.is_watched()
            && !memory.is_busy()
    }

    /// Returns true if the episode sleeps.
    pub fn sleeps(&self) -> bool {
        self.stage.status.sleep().is_some()
    }

    /// Returns the time since the last request.
    pub fn idle(&self) -> Duration {
        self.stage.status.idle()
    }

    /// Runs a call of the policy that controls all robots and returns its reply.
    pub async fn call(&self, tool: ToolCall) -> Result<Answer, HostingError> {
        self.ask(None, tool.into(), None, Box::new(|answer| answer)).await
    }

    /// Runs a call with all its options, also for the operator of a single robot.
    ///
    /// `told` converts the answer before it is sent. The converted answer is the one kept for a call with
    /// a key.
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

    /// Keeps an answer that was combined from several for repeated requests.
    pub async fn keep_answer(&self, keyed: Keyed, answer: Answer) -> Result<Answer, HostingError> {
        let answer = Box::new(answer);
        self.do_job_in_turn(|reply| Job::KeepAnswer { keyed, answer, reply }).await
    }

    /// Parses an operator's command. Refuses commands that cannot be executed or whose observation could
    /// not be rendered.
    pub async fn read_command(&self, call: OperatorCall) -> Result<OperatorCommand, HostingError> {
        self.do_job(|reply| Job::ReadCommand { call: call.into(), reply }).await
    }

    /// Executes commands of several operators side by side. Returns one answer for each, with the
    /// requested observation, converted by `told`.
    pub async fn together(
        &self,
        commands: Vec<(OperatorCommand, Option<Keyed>)>,
        told: Tell<Vec<Answer>>,
    ) -> Result<Vec<Answer>, HostingError> {
        let (commands, keyed) = commands.into_iter().unzip();
        // Callers are waiting for it already, so it queues up.
        self.do_job_in_turn(|reply| Job::Together { commands, keyed, told, reply }).await
    }

    /// Records a note of the policy that controls all robots, or of the operator of one.
    pub async fn note(
        &self,
        operator: Option<&str>,
        note: Note,
        key: Option<String>,
    ) -> Result<(), HostingError> {
        let (operator, note) = (operator.map(str::to_owned), Box::new(note));
        self.do_job(|reply| Job::Note { operator, note, key, reply }).await
    }

    /// Records a call that was refused before it arrived here, after its caller's earlier calls. A
    /// failure is ignored.
    pub async fn refused(&self, operator: Option<&str>, call: RefusedCall) {
        let (operator, call) = (operator.map(str::to_owned), Box::new(call));
        let _ = self.do_job_in_turn(|reply| Job::Refused { operator, call, reply }).await;
    }

    /// Returns the state of the episode for watchers; it does not count as a call of the policy.
    pub async fn status(&self) -> Result<Answer, HostingError> {
        self.do_job(|reply| Job::Status { reply }).await
    }

    /// Returns the briefing for the current state.
    pub async fn briefing(&self) -> Result<Briefing, HostingError> {
        self.do_job(|reply| Job::Briefing { reply }).await
    }

    /// Returns the current state and a stream of the events from now on, for a watcher. It does not count
    /// as a call of the policy.
    pub async fn watch(&self) -> Result<LiveWatch, HostingError> {
        self.watch_as(None).await
    }

    /// Does the same as [`EpisodeThread::watch`] for the person who drives `robot` and receives every
    /// step. That person sees privileged information, which is recorded and named in results.
    pub async fn watch_driving(&self, robot: &str) -> Result<(LiveWatch, EveryStep), HostingError> {
        Ok((self.watch_as(Some(robot.into())).await?, self.stage.feed.every_step()))
    }

    async fn watch_as(&self, operator: Option<String>) -> Result<LiveWatch, HostingError> {
        // Subscribing comes first, so that no event is missed in between.
        let events = self.stage.feed.subscribe().ok_or(HostingError::EpisodeStopped)?;
        let _turn = self.looking.acquire().await.map_err(|_| HostingError::EpisodeStopped)?;
        let view = self.do_job_in_turn(|reply| Job::Watch { operator, reply }).await?;
        Ok(LiveWatch { view, events })
    }

    /// Returns all poses and contacts, for experts and scoring in this process and never for policies.
    pub fn facts_blocking(&self) -> Result<Facts, HostingError> {
        self.work_blocking(|session| Ok(session.facts()))
    }

    /// Returns the robots' uncompressed images for a policy that is queried from this process. `shown`
    /// names the extra information that policies usually do not get; results name it.
    pub fn look_blocking(
        &self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, HostingError> {
        let (observe, shown) = (observe.clone(), shown.to_vec());
        self.work_blocking(move |session| Ok(session.observe(&observe, &shown)?))
    }

    /// Returns the image of the third-person camera for the same policies.
    pub fn room_blocking(&self) -> Result<Picture, HostingError> {
        self.work_blocking(|session| Ok(session.third_person()))
    }

    /// Ends the episode if its policy's clock has run out, or if it has made no call for `idle`.
    pub fn end_if_abandoned(&self, idle: Duration) {
        match self.stage.status.sleep() {
            Some(sleep) if sleep.thinking() < idle => {}
            // An episode that has stopped meanwhile has ended.
            Some(_) => drop(self.send(Job::EndIfAbandoned { idle })),
            None => {
                let jobs = lock(&self.jobs);
                // If calls are waiting, the caller is still there, and the places in the queue are for
                // calls.
                if jobs.capacity() == jobs.max_capacity() {
                    let _ = jobs.try_send(Job::EndIfAbandoned { idle });
                }
            }
        }
    }

    /// Ends the episode for an external reason after the calls already waiting, unless it has ended by
    /// then.
    pub fn end(&self, reason: EndReason) -> Result<(), HostingError> {
        self.send(Job::End { reason })
    }

    /// Does the same as [`EpisodeThread::end`], however many calls wait.
    ///
    /// It blocks while the queue is full, so it must not be called from async code.
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

    /// Does the same as [`EpisodeThread::close`] for an episode that will be brought back.
    pub async fn leave(&self) -> Result<ResultReply, HostingError> {
        self.do_job_in_turn(|reply| Job::Close { keep: true, reply }).await
    }

    /// Does the same as [`EpisodeThread::close`] for an ended episode whose result is not needed.
    pub async fn end_for_good(&self) -> Result<(), HostingError> {
        match self.sleeps() {
            true => self.stage.forget_journal(),
            false => self.close().await.map(drop),
        }
    }

    /// Returns true once the episode takes no more commands.
    pub fn ended(&self) -> bool {
        self.end_reason().is_some() || (!self.sleeps() && lock(&self.jobs).is_closed())
    }

    /// Returns the reason why the episode has ended, as known after its last call.
    pub fn end_reason(&self) -> Option<EndReason> {
        self.stage.status.ended.get().copied()
    }

    /// Returns the control steps executed up to the last call, including the initial hold.
    pub fn env_steps(&self) -> u32 {
        self.stage.status.env_steps()
    }

    /// Returns the specification of the episode.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.stage.spec
    }

    /// Returns the robots of the episode, in order.
    pub fn robots(&self) -> &[String] {
        &self.robots
    }

    /// Returns the policy's thinking time up to its last call.
    pub fn thought(&self) -> Duration {
        self.stage.status.thought()
    }

    /// Returns the unredacted result; `None` until the episode has been closed.
    pub fn result(&self) -> Option<&ResultReply> {
        self.stage.status.result.get()
    }

    /// Returns the reason why the recording is incomplete, if it is.
    pub fn recording_failed(&self) -> Option<&str> {
        self.stage.status.recording_failed.get().map(String::as_str)
    }

    /// Returns the maximum number of control steps for one command.
    pub fn steps_per_command(&self) -> u32 {
        self.steps_per_command
    }

    /// Returns the folder of the recording.
    pub fn folder(&self) -> &Path {
        &self.stage.folder.path
    }

    /// Queues a job, unless too many are waiting already, and awaits its reply.
    async fn do_job<T>(&self, job: impl FnOnce(ReplySender<T>) -> Job) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(job(reply))?;
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Runs `work` on the session, unless too many jobs are waiting already. For threads outside the
    /// async runtime.
    fn work_blocking<T: Send + 'static>(
        &self,
        work: impl FnOnce(&mut Session) -> Result<T, HostingError> + Send + 'static,
    ) -> Result<T, HostingError> {
        let (reply, answer) = oneshot::channel();
        self.send(work_job(work, reply))?;
        answer.blocking_recv().map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Runs `work` on the session in its turn.
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
        // The episode may fall asleep between the two.
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

    /// Returns the queue of the thread. Starts the thread if the episode sleeps.
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
