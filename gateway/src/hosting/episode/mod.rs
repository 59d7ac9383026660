//! The thread that owns the world of one episode.
//!
//! Calls reach the thread through a bounded channel, each with a reply channel. A call whose caller has
//! disconnected is still completed, recorded and charged.

mod desk;
mod onlookers;
mod panic_guard;
mod queue;
mod stage;
mod status;
mod work;

use std::{
    path::Path,
    sync::{Arc, atomic::Ordering},
    time::Duration,
};

use tandem_episodes::{
    CallReply, Clock, EpisodeSpec, Facts, JournalEntry, OperatorCall, OperatorCommand, Picture, PlanAdvance,
    PlanRun, TeamObservation, monotonic,
};
use tandem_tools_spec::{
    Briefing, Call, EndReason, ExtraInformation, ManageReply, Note, Observe, PlanCall, PlanReply,
    ResultReply, ToolCall, ToolReply,
};
use tokio::sync::{Semaphore, mpsc, oneshot};

use super::{
    Answer, HostingError, RefusedCall,
    durable::{Heading, Keyed},
};
use desk::{Closing, Desk, Job};
use onlookers::EveryStep;
pub use onlookers::LiveWatch;
pub use panic_guard::{EpisodeMetrics, PanicGuard};
pub use queue::WAITING_CALLS;
use queue::{JobQueue, job};
use stage::Stage;
pub use stage::{HostMemory, Surroundings};
use status::SharedStatus;
use work::Opening;

/// Handle of an episode. A suspended episode has no thread, and any request resumes it. Dropping the last
/// handle closes the recording.
#[derive(Debug)]
pub struct EpisodeThread {
    queue: JobQueue,
    stage: Arc<Stage>,
    robots: Vec<String>,
    steps_per_command: u32,
    /// Limits the number of watchers that join at the same time, so that they do not fill the queue of calls.
    looking: Semaphore,
}

impl EpisodeThread {
    /// Creates the world on a separate thread, runs the initial hold and returns the policy's briefing.
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

    /// Creates a suspended episode whose journal contains `entries` and whose start returned `briefing`.
    pub fn asleep<'a>(
        id: &str,
        spec: EpisodeSpec,
        surroundings: Surroundings,
        briefing: &Briefing,
        entries: impl Iterator<Item = &'a JournalEntry>,
    ) -> EpisodeThread {
        let status = SharedStatus::asleep(entries, briefing.status.env_steps);
        let stage = Arc::new(Stage::new(id, spec, surroundings, status));
        // The channel has no receiver, so the first job resumes the episode.
        EpisodeThread::on(stage, mpsc::channel(1).0, briefing)
    }

    fn on(stage: Arc<Stage>, jobs: mpsc::Sender<Job>, briefing: &Briefing) -> EpisodeThread {
        EpisodeThread {
            queue: JobQueue::new(stage.clone(), jobs),
            stage,
            robots: briefing.robots.iter().map(|robot| robot.robot.clone()).collect(),
            steps_per_command: briefing.status.budget.steps_per_command,
            looking: Semaphore::new(1),
        }
    }

    /// Begins to write a journal from which a later process can restore the episode.
    pub async fn begin_journal(&self, heading: Heading) -> Result<(), HostingError> {
        self.queue.work(move |desk| desk.begin_journal(&heading)).await
    }

    /// Resumes the episode if it is suspended, and returns once its state is restored.
    pub async fn awake(&self) -> Result<(), HostingError> {
        // A running thread is not enough: the answers in the journal have to be restored first.
        match self.stage.status.is_there() {
            true => Ok(()),
            false => self.queue.work(|_| Ok(())).await,
        }
    }

    /// Suspends the episode if it can be resumed and nobody is affected.
    pub fn put_aside(&self) {
        if self.may_sleep() {
            self.queue.send_if_idle(job(Desk::sleep).0);
        }
    }

    /// Returns true if the episode could be suspended.
    pub fn may_sleep(&self) -> bool {
        let Stage { status, feed, memory, .. } = &*self.stage;
        status.durable.load(Ordering::Relaxed)
            && status.sleep().is_none()
            && !feed.is_watched()
            && !memory.is_busy()
    }

    /// Returns true if the episode is suspended.
    pub fn sleeps(&self) -> bool {
        self.stage.status.sleep().is_some()
    }

    /// Returns the time since the last request.
    pub fn idle(&self) -> Duration {
        self.stage.status.idle()
    }

    /// Runs a call of the policy that controls all robots and returns its reply.
    pub async fn call(&self, tool: ToolCall) -> Result<Answer, HostingError> {
        self.ask(None, tool.into(), None, |answer| answer).await
    }

    /// Runs a call with all its options, also for the operator of a single robot.
    ///
    /// `then` converts the answer before it is sent. For a call with a key, the converted answer is kept.
    pub async fn ask(
        &self,
        operator: Option<&str>,
        call: Call,
        keyed: Option<Keyed>,
        then: impl FnOnce(Answer) -> Answer + Send + 'static,
    ) -> Result<Answer, HostingError> {
        let operator = operator.map(str::to_owned);
        let answer = self
            .queue
            .work_unless_full(move |desk| {
                let answer = desk.on_session(|session| {
                    let reply = session.ask(operator.as_deref(), call)?;
                    Ok(then(Answer::new(reply, session)))
                });
                desk.commit(keyed.as_ref().zip(answer.as_ref().ok()));
                answer
            })
            .await;
        answer.inspect_err(|error| self.stage.status.refuse(error.to_string()))
    }

    /// Keeps an answer that was combined from several answers, for repeated requests.
    pub async fn keep_answer(&self, keyed: Keyed, answer: Answer) -> Result<Answer, HostingError> {
        self.queue
            .work(move |desk| {
                desk.commit([(&keyed, &answer)]);
                Ok(answer)
            })
            .await
    }

    /// Parses an operator's command. Returns an error if the command cannot be executed or its observation
    /// cannot be rendered.
    pub async fn read_command(&self, call: OperatorCall) -> Result<OperatorCommand, HostingError> {
        self.queue.work_unless_full(|desk| desk.run(|session| Ok(session.read_command(call)?))).await
    }

    /// Executes commands of several operators simultaneously. Returns one answer per command, with the
    /// requested observation, converted by `then`.
    pub async fn together(
        &self,
        commands: Vec<(OperatorCommand, Option<Keyed>)>,
        then: impl FnOnce(Vec<Answer>) -> Vec<Answer> + Send + 'static,
    ) -> Result<Vec<Answer>, HostingError> {
        let (commands, keyed): (Vec<_>, Vec<_>) = commands.into_iter().unzip();
        // Callers are waiting for this step already, so it is queued even if the queue is full.
        self.queue
            .work(move |desk| {
                let answers = desk.on_session(|session| {
                    let replies = session.together(commands)?.into_iter();
                    Ok(then(replies.map(|reply| Answer::new(reply, session)).collect()))
                });
                let made = answers.as_deref().unwrap_or_default();
                desk.commit(
                    keyed.iter().zip(made).filter_map(|(keyed, answer)| Some((keyed.as_ref()?, answer))),
                );
                answers
            })
            .await
    }

    /// Records a note of the policy that controls all robots, or of the operator of one robot.
    pub async fn note(
        &self,
        operator: Option<&str>,
        note: Note,
        key: Option<String>,
    ) -> Result<(), HostingError> {
        let operator = operator.map(str::to_owned);
        self.queue.work_unless_full(move |desk| desk.note(operator.as_deref(), note, key)).await
    }

    /// Records a call that was refused before it reached the episode. It is recorded after the caller's
    /// earlier calls, and failures are ignored.
    pub async fn refused(&self, operator: Option<&str>, call: RefusedCall) {
        let (operator, RefusedCall { tool, arguments, problem }) = (operator.map(str::to_owned), call);
        self.stage.status.refuse(problem.clone());
        let recorded = self.queue.run(move |session| {
            session.refused_before(operator.as_deref(), &tool, &arguments, &problem);
            Ok(())
        });
        let _ = recorded.await;
    }

    /// Returns the state of the episode for watchers. The request does not count as a call of the policy.
    pub async fn status(&self) -> Result<Answer, HostingError> {
        self.queue
            .work_unless_full(|desk| {
                desk.on_session(|session| {
                    let reply = ToolReply::Manage(ManageReply::GetStatus(session.status()));
                    Ok(Answer::new(CallReply { reply, observation: None }, session))
                })
            })
            .await
    }

    /// Returns the briefing for the current state.
    pub async fn briefing(&self) -> Result<Briefing, HostingError> {
        self.queue.work_unless_full(|desk| desk.on_session(|session| Ok(session.briefing()))).await
    }

    /// Returns the current state and a stream of the events from now on, for a watcher. The request does not
    /// count as a call of the policy.
    pub async fn watch(&self) -> Result<LiveWatch, HostingError> {
        self.watch_as(None).await
    }

    /// Does the same as [`EpisodeThread::watch`] for the person who drives `robot` and receives every step.
    /// The recording and the results name the privileged information that this person sees.
    pub async fn watch_driving(&self, robot: &str) -> Result<(LiveWatch, EveryStep), HostingError> {
        Ok((self.watch_as(Some(robot.into())).await?, self.stage.feed.every_step()))
    }

    async fn watch_as(&self, operator: Option<String>) -> Result<LiveWatch, HostingError> {
        // The subscription comes before the view, so that no event between them is missed.
        let events = self.stage.feed.subscribe().ok_or(HostingError::EpisodeStopped)?;
        let _turn = self.looking.acquire().await.map_err(|_| HostingError::EpisodeStopped)?;
        let view = self.queue.run(move |session| match operator {
            Some(robot) => Ok(session.drivers_view(&robot)?),
            None => Ok(session.live_view()),
        });
        let view = view.await?;
        Ok(LiveWatch { view, events })
    }

    /// Returns all poses and contacts. They are for experts and scoring in this process, never for policies.
    pub fn facts_blocking(&self) -> Result<Facts, HostingError> {
        self.queue.run_blocking(|session| Ok(session.facts()))
    }

    /// Returns the robots' uncompressed images for a policy that this process queries. `shown` is the
    /// additional information that the benchmark withholds from policies; results name it.
    pub fn look_blocking(
        &self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, HostingError> {
        let (observe, shown) = (observe.clone(), shown.to_vec());
        self.queue.run_blocking(move |session| Ok(session.observe(&observe, &shown)?))
    }

    /// Returns the image of the third-person camera, for a policy that this process queries.
    pub fn room_blocking(&self) -> Result<Picture, HostingError> {
        self.queue.run_blocking(|session| Ok(session.third_person()))
    }

    /// Ends the episode if its policy has used up its thinking time, or has made no call for `idle`.
    pub fn end_if_abandoned(&self, idle: Duration) {
        let job = job(move |desk| desk.end_if_abandoned(idle)).0;
        match self.stage.status.sleep() {
            Some(sleep) if sleep.thinking() < idle => {}
            // The error of an episode that has stopped meanwhile is ignored.
            Some(_) => drop(self.queue.send(job)),
            // If calls are waiting, the episode is not abandoned, so the job is not queued.
            None => self.queue.send_if_idle(job),
        }
    }

    /// Ends the episode for an external reason, after the calls already waiting. Has no effect if the episode
    /// has ended by then.
    pub fn end(&self, reason: EndReason) -> Result<(), HostingError> {
        self.queue.send(end(reason))
    }

    /// Does the same as [`EpisodeThread::end`], however many calls are waiting.
    ///
    /// The method blocks while the queue is full, so it must not be called from async code.
    pub fn end_blocking(&self, reason: EndReason) {
        self.queue.send_blocking(end(reason));
    }

    /// Ends the episode after the calls already waiting, closes its recording and returns the result.
    pub async fn close(&self) -> Result<ResultReply, HostingError> {
        self.close_for(false).await
    }

    /// Does the same as [`EpisodeThread::close`], but keeps the journal, so that the episode can be resumed
    /// later.
    pub async fn leave(&self) -> Result<ResultReply, HostingError> {
        self.close_for(true).await
    }

    async fn close_for(&self, keep: bool) -> Result<ResultReply, HostingError> {
        let (reply, result) = oneshot::channel();
        let job: Job = Box::new(move |desk| match desk {
            Ok(desk) => desk.close_after_this(Closing { keep, reply }),
            Err(why) => drop(reply.send(Err(why))),
        });
        self.queue.send_in_turn(job).await?;
        result.await.map_err(|_| HostingError::EpisodeStopped)?
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
        self.end_reason().is_some() || (!self.sleeps() && self.queue.is_closed())
    }

    /// Returns the reason why the episode has ended, as of its last call; `None` before it ends.
    pub fn end_reason(&self) -> Option<EndReason> {
        self.stage.status.ended.get().copied()
    }

    /// Returns the control steps executed up to the last call, including the initial hold.
    pub fn env_steps(&self) -> u32 {
        self.stage.status.env_steps()
    }

    /// Returns the reason why the last refused call was refused.
    pub fn last_refusal(&self) -> Option<String> {
        self.stage.status.last_refusal()
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

    /// Begins the plan that came with the operator's call `own`. Returns an error if one of the plan's
    /// commands cannot be executed.
    pub async fn begin_plan(&self, own: OperatorCall, plan: PlanCall) -> Result<PlanRun, HostingError> {
        self.queue.run(move |session| Ok(session.begin_plan(&own, &plan)?)).await
    }

    /// Advances the plan, and returns it with its next command or its end.
    pub async fn advance_plan(&self, mut run: PlanRun) -> Result<(PlanRun, PlanAdvance), HostingError> {
        self.queue
            .run(move |session| {
                let next = run.advance(session);
                Ok((run, next))
            })
            .await
    }

    /// Returns the reply to an operator's plan that has ended, and the episode's current control step.
    pub async fn end_plan(
        &self,
        call: Call,
        run: PlanRun,
        stopped: Option<String>,
    ) -> Result<(PlanReply, u32), HostingError> {
        self.queue.run(move |session| Ok((session.end_plan(&call, run, stopped)?, session.env_steps()))).await
    }
}

/// Creates a job that ends the episode.
fn end(reason: EndReason) -> Job {
    let end = move |desk: &mut Desk| {
        desk.run(|session| {
            session.end(reason);
            Ok(())
        })
    };
    job(end).0
}
