//! Sessions: an episode's world, its rules, and the tool calls that act on it. A session is synchronous and
//! runs on its own thread.

mod answer;
mod build;
mod calls;
mod checkpoint;
mod clock;
mod failure;
mod journal;
mod notes;
mod onlookers;
mod plan;
mod replay;
mod run_files;
mod status;
mod told;

pub use build::{Built, build_world};
pub use calls::{Audience, CallReply, Caller, Outcome, Request};
pub use checkpoint::{Checkpoint, FailedStep};
pub use clock::{Clock, monotonic};
pub use failure::FAILED_STEP_FILE;
use failure::Rewind;
pub use journal::JournalEntry;
use journal::{Journal, KeptRequest};
use onlookers::Spectators;
pub use plan::{PlanAdvance, PlanRun};
pub use replay::BringBack;
pub(crate) use replay::Replay;
pub use run_files::{RunFiles, RunFolder};

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use nalgebra::Vector3;
use tandem_sim::render::RenderRequest;
use tandem_sim::{CONTROL_HZ, MotorSetpoints, RobotCommand, Step, World};
use tandem_tools_spec::{EndReason, OperatorUse, ResultReply, Usage};

use crate::commands::{Clamped, Command, Executed, Motion, MotionState, TargetCounts, Trajectory};
use crate::convert::isometry_from_sim;
use crate::observation::{Observer, Picture};
use crate::protocol::Rules;
use crate::recording::{BEGIN, state_hash_text};
use crate::scoring::{Facts, Phase, Scores};
use crate::spec::{EpisodeSpec, Start};
use crate::stress::Execution;
use crate::variation::Disturbance;
use crate::{EpisodeError, fingerprint};
use checkpoint::Origin;
use clock::ThinkingClock;
use told::ShownInformation;

/// One episode from start to result.
pub struct Session {
    origin: Origin,
    rules: Rules,
    world: World,
    /// State after the last control step.
    present: Arc<Step>,
    motions: Vec<Motion>,
    scores: Scores,
    /// Control steps of the world before the episode, which may start in the middle of another one.
    steps_before: u64,
    clock: ThinkingClock,
    observer: Observer,
    files: Option<RunFiles>,
    spectators: Spectators,
    /// Number of tool calls, up to the end.
    tool_calls: u32,
    /// Number of requests: a plan counts as one, like a single call. `None` in a replay, where the calls of
    /// plans are not marked.
    requests: Option<u32>,
    /// Requests and thinking time of the operators, by robot, as the host reports with their commands.
    operators: BTreeMap<String, OperatorUse>,
    /// True while the commands of a plan are made.
    planning: bool,
    /// Number of calls recorded or shown, including those that do not count.
    told_calls: u32,
    /// Usage reported in notes.
    usage: Usage,
    /// Computation time of physics, for the real-time factor.
    physics: Duration,
    ended: Option<EndReason>,
    /// Reason of a simulator failure, if there was one.
    simulator_failure: Option<String>,
    rewind: Rewind,
    /// Information shown to the policy that the benchmark withholds from its policies.
    shown: ShownInformation,
    /// Departures from the benchmark in the policy's commands.
    departures: BTreeSet<String>,
    /// Counts of the policy's joint targets.
    targets: TargetCounts,
    /// Execution that differs from the commands, if there is any.
    execution: Option<Execution>,
    /// State hashes of the steps since they were last taken; `None` unless requested.
    hashes: Option<Vec<u64>>,
    /// Journal of requests, if one is kept.
    journal: Option<Journal>,
    /// Final result, set when the files are closed; every caller receives this result.
    result: Option<ResultReply>,
}

impl Session {
    /// Builds the world of `spec` and brings it to the start of the episode, which under some protocols
    /// follows an initial hold. With a folder, the episode is recorded there.
    ///
    /// # Errors
    ///
    /// Returns the reason why the world cannot be built, or the start state cannot be read.
    pub fn start(spec: &EpisodeSpec, folder: Option<&Path>) -> Result<Session, EpisodeError> {
        Session::start_with_clock(spec, folder.map(RunFolder::from), monotonic())
    }

    /// Starts a session like [`Session::start`], with the policy's wall clock read from `clock`.
    pub fn start_with_clock(
        spec: &EpisodeSpec,
        folder: Option<RunFolder>,
        clock: Clock,
    ) -> Result<Session, EpisodeError> {
        let mut session = Session::build(spec, clock)?;
        session.begin(folder)?;
        session.clock.resume();
        Ok(session)
    }

    /// Builds the world of `spec` at the task's own start.
    fn build(spec: &EpisodeSpec, clock: Clock) -> Result<Session, EpisodeError> {
        let Built { world, motions, robot, locomotion } = build_world(spec)?;
        let rules = spec.rules();
        let present = Arc::new(world.present());
        let rest = (0..motions.len()).map(|robot| world.rest_command(robot)).collect();
        let disturbance = Disturbance::new(spec.variation.disturb, spec.world_seed(), motions.len());
        let begin_s = f64::from(rules.initial_hold_steps) / CONTROL_HZ;
        Ok(Session {
            origin: Origin { spec: spec.clone(), robot, locomotion },
            rules,
            scores: spec.task.scores(&motions[0].robot.model, &present)?,
            clock: ThinkingClock::new(rules.thinking.filter(|_| spec.operators.is_one()), clock),
            operators: BTreeMap::new(),
            observer: Observer::new(spec, &world),
            files: None,
            spectators: Spectators::default(),
            steps_before: 0,
            tool_calls: 0,
            requests: Some(0),
            planning: false,
            told_calls: 0,
            usage: Usage::default(),
            physics: Duration::ZERO,
            ended: None,
            simulator_failure: None,
            rewind: Rewind::default(),
            shown: ShownInformation::default(),
            departures: BTreeSet::new(),
            targets: TargetCounts::default(),
            execution: Execution::of(spec.stress, disturbance, spec.world_seed(), begin_s, rest),
            hashes: None,
            journal: None,
            result: None,
            motions,
            present,
            world,
        })
    }

    /// Brings a newly built world to the start of its episode.
    fn begin(&mut self, folder: Option<RunFolder>) -> Result<(), EpisodeError> {
        let hold_steps = match &self.origin.spec.start {
            Start::Task => self.rules.initial_hold_steps,
            Start::Checkpoint(path) => {
                self.resume(&Checkpoint::read(path)?)?;
                0
            }
            Start::Phase(start) => {
                self.take_up(&Checkpoint::of_phase(start)?)?;
                0
            }
            Start::Moment(start) => {
                self.take_up(&Replay::checkpoint_at(start)?)?;
                0
            }
        };
        if let Some(folder) = folder {
            self.files = Some(RunFiles::create(folder, self));
        }
        self.keep_moment("start");
        self.hold(hold_steps)?;
        match self.origin.spec.start {
            Start::Task => self.keep_checkpoint(&Phase::number(0)),
            Start::Checkpoint(_) | Start::Phase(_) | Start::Moment(_) => self.keep_checkpoint(BEGIN),
        }
        if let Some(files) = &mut self.files {
            files.flush();
        }
        Ok(())
    }

    /// Returns the fraction of joint targets beyond the joints' limits.
    pub fn joints_clamped_share(&self) -> f64 {
        self.targets.beyond_share()
    }

    /// Lets all robots stand still for this many control steps.
    fn hold(&mut self, steps: u32) -> Result<(), EpisodeError> {
        match steps {
            0 => Ok(()),
            steps => self.run(&Command::hold(steps)).map(drop),
        }
    }

    /// Ends the episode of an absent policy: its wall clock has run out, or its last call was `idle` ago.
    pub fn end_if_abandoned(&mut self, idle: Duration) {
        let reason = if self.clock.exhausted() {
            EndReason::WallClockExhausted
        } else if self.clock.thinking() >= idle {
            EndReason::Abandoned
        } else {
            return;
        };
        self.end(reason);
    }

    /// Ends the episode for an external reason, unless it has already ended, and closes its files.
    pub fn end(&mut self, reason: EndReason) {
        let arrival = self.arrival(|| KeptRequest::end(reason));
        self.ended.get_or_insert(reason);
        self.settle();
        self.write_down(arrival);
    }

    /// Closes the files once; after this the result is final.
    fn settle(&mut self) {
        if self.result.is_some() {
            return;
        }
        // No thinking time is charged any more.
        self.clock.pause();
        if !self.scores.complete() {
            self.keep_moment("end");
        }
        let mut result = self.result();
        if let Some(files) = &mut self.files {
            files.finish(&mut result, &self.origin.spec.task, &mut self.observer);
        }
        self.result = Some(result);
        self.show_end();
    }

    /// Executes a command, with fewer steps if the last phase is reached or the budget ends. Returns the
    /// number of steps, and the clamped values of each order.
    fn run(&mut self, command: &Command) -> Result<(u32, Vec<Clamped>), EpisodeError> {
        let left = self.steps_left();
        self.motions.iter_mut().for_each(Motion::begin_command);
        let mut trajectories: Vec<Trajectory> = self.motions.iter().map(|_| Trajectory::Hold).collect();
        let mut clamped = Vec::with_capacity(command.orders.len());
        for order in &command.orders {
            self.departures.extend(order.action.departures());
            let motion = &mut self.motions[order.robot];
            let (trajectory, beyond) = Trajectory::begin(&order.action, order.steps.min(left), motion);
            trajectories[order.robot] = trajectory;
            self.targets.add(beyond.targets);
            clamped.push(beyond);
        }
        let steps = command.steps.min(left);
        for step in 1..=steps {
            self.step(step, &trajectories)?;
            if self.has_succeeded() {
                return Ok((step, clamped));
            }
        }
        Ok((steps, clamped))
    }

    /// Makes one control step, number `step` of a command: from the robots' trajectories to scores and
    /// recording.
    fn step(&mut self, step: u32, trajectories: &[Trajectory]) -> Result<(), EpisodeError> {
        let started = Instant::now();
        let motions: Vec<MotionState> = self.motions.iter().map(|motion| motion.state().clone()).collect();
        let moves = trajectories.iter().zip(&mut self.motions);
        let commands: Vec<RobotCommand> =
            moves.map(|(trajectory, motion)| trajectory.command(step, motion)).collect();
        self.rewind.before_step(&self.world);
        let remembered = self.execution.as_ref().map(|execution| execution.memory().clone());
        let executed = Executed { commands: self.executed(&commands), setpoints: self.setpoints() };
        let stepped = executed.step(&mut self.world);
        self.physics += started.elapsed();
        match stepped {
            Ok(mut present) => {
                // The recorded label is the command that was given.
                for (robot, told) in present.robots.iter_mut().zip(commands) {
                    robot.command = told;
                }
                self.present = Arc::new(present);
            }
            Err(diverged) => {
                if let (Some(execution), Some(memory)) = (&mut self.execution, remembered) {
                    execution.set_memory(memory);
                }
                return Err(self.fail(diverged, executed, motions));
            }
        }
        let recorded = self.files.is_some().then(|| self.recorded(&executed));
        self.rewind.stepped(executed);
        for (motion, robot) in self.motions.iter_mut().zip(&self.present.robots) {
            let hands_n =
                robot.estimate.hand_force_n.map(|force_n| Vector3::from(force_n.to_array().map(f64::from)));
            motion.sense(isometry_from_sim(&robot.estimate.world_from_pelvis), hands_n);
            motion.feel(&robot.sensed);
        }
        let (was_underway, reached_before) =
            (self.scores.next_phase().underway(), self.scores.reached().count());
        let scored = self.scores.update(&self.present);
        let budget = self.budget();
        if let Some(hashes) = &mut self.hashes {
            hashes.push(self.world.state_hash());
        }
        if let (Some(files), Some(recorded)) = (&mut self.files, recorded) {
            files.step(self.present.clone(), recorded, self.world.state_hash(), scored.facts, budget);
        }
        self.show_step(budget);
        if scored.reached {
            self.phases_reached(reached_before);
        } else if self.scores.next_phase().underway() && !was_underway {
            self.keep_moment("together");
        }
        Ok(())
    }

    /// Returns the commands that the robots execute in the next step in place of `commands`.
    fn executed(&mut self, commands: &[RobotCommand]) -> Vec<RobotCommand> {
        let Some(execution) = &mut self.execution else { return commands.to_vec() };
        let robots = self.motions.iter().map(|motion| (&*motion.robot.model, &motion.robot.base_limits));
        execution.execute(self.present.time_s, commands, robots)
    }

    /// Returns the setpoints of the robots' motors in the next step, by robot; empty if no robot has any.
    fn setpoints(&self) -> Vec<Vec<MotorSetpoints>> {
        match self.motions.iter().all(|motion| motion.setpoints().is_empty()) {
            true => Vec::new(),
            false => self.motions.iter().map(|motion| motion.setpoints().to_vec()).collect(),
        }
    }

    /// Returns the recorded data of a step besides the commands. Executed commands are included only if they
    /// may differ from the policy's.
    fn recorded(&self, executed: &Executed) -> Executed {
        match self.execution {
            Some(_) => executed.clone(),
            None => Executed { commands: Vec::new(), setpoints: executed.setpoints.clone() },
        }
    }

    /// Records the phases reached in this step, which are those from number `first` on.
    fn phases_reached(&mut self, first: usize) {
        let reached = self.reached();
        for phase in &reached[first..] {
            self.keep_moment(&format!("{} {}", phase.number, phase.id.replace('_', " ")));
            if let Some(files) = &mut self.files {
                files.phase(phase);
            }
            self.show_phase(phase);
        }
        if !self.scores.complete() {
            self.keep_checkpoint(&Phase::number(reached.len()));
        }
    }

    /// Saves a checkpoint at the beginning of a phase, if the episode is recorded.
    fn keep_checkpoint(&mut self, name: &str) {
        if self.files.is_some() {
            let checkpoint = self.checkpoint().and_then(|checkpoint| checkpoint.to_bytes());
            if let Some(files) = &mut self.files {
                files.checkpoint(name, self.present.time_s, checkpoint);
            }
        }
    }

    /// Saves this moment for the strip, if the episode is recorded.
    fn keep_moment(&mut self, caption: &str) {
        if let Some(files) = &mut self.files {
            files.keep(caption, &self.present);
        }
    }

    /// Returns the spec of the episode.
    pub fn spec(&self) -> &EpisodeSpec {
        &self.origin.spec
    }

    /// Returns the state after the last control step.
    pub fn present(&self) -> &Step {
        &self.present
    }

    /// Returns the facts for scoring and experts.
    pub fn facts(&self) -> Facts {
        self.scores.facts(&self.present)
    }

    /// Renders the scene's camera that sees all robots, which no tool shows. The policy's clock is paused
    /// meanwhile.
    pub fn third_person(&mut self) -> Picture {
        self.clock.pause();
        let picture = self.observer.third_person(&self.present);
        self.let_think();
        picture
    }

    /// Renders a robot's head camera in this size, with an unchanged vertical field of view: red, green
    /// and blue, row by row. This is no call; the caller counts the images shown to a policy.
    pub fn eye(&mut self, robot: usize, size_px: [u32; 2]) -> Vec<u8> {
        self.observer.eye(&self.present, robot, size_px)
    }

    /// Returns true if [`Session::eyes`] is the faster way to render several episodes.
    pub fn draws_together(&self) -> bool {
        self.observer.draws_together()
    }

    /// Returns a request for the images of [`Session::eye`] of all robots before they are scaled. It is
    /// rendered together with the requests of other episodes.
    pub fn eyes(&mut self, size_px: [u32; 2]) -> RenderRequest<'_> {
        self.observer.eyes(&self.present, size_px)
    }

    /// Returns the progress of the task: the number of phases reached plus the nearness of the next, from
    /// 0 to 1.
    pub fn progress(&self) -> f64 {
        self.scores.progress(&self.present)
    }

    /// Returns the number of phases reached.
    pub fn reached_phases(&self) -> usize {
        self.scores.reached().count()
    }

    /// Returns the computation time of physics.
    pub fn physics(&self) -> Duration {
        self.physics
    }

    /// Returns the policy's thinking time up to its last call.
    pub fn thought(&self) -> Duration {
        self.clock.spent()
    }

    /// Returns the policy's thinking time since the last reply.
    pub fn thinking(&self) -> Duration {
        self.clock.thinking()
    }

    /// Returns the reason for the end of the episode; `None` while it runs.
    pub fn ended(&self) -> Option<EndReason> {
        self.ended
    }

    /// Returns the state hash, 16 hexadecimal digits; equal physical states have equal hashes.
    pub fn state_hash(&self) -> String {
        state_hash_text(self.world.state_hash())
    }

    /// Returns the reason why the recording is incomplete, if it is. The episode continues without it.
    pub fn recording_failed(&self) -> Option<&str> {
        self.files.as_ref().and_then(RunFiles::failed)
    }

    /// Ends the episode and writes the files of a recorded one.
    pub fn close(self) -> ResultReply {
        self.close_as(EndReason::Finished)
    }

    /// Closes an episode like [`Session::close`] that could not continue, with the reason.
    pub fn close_failed(mut self, why: String) -> ResultReply {
        self.simulator_failure.get_or_insert(why);
        self.close_as(EndReason::SimulatorFailed)
    }

    fn close_as(mut self, reason: EndReason) -> ResultReply {
        self.end(reason);
        self.result()
    }
}

/// Returns [`fingerprint::build`], with its error as an [`EpisodeError`].
fn this_build() -> Result<&'static str, EpisodeError> {
    fingerprint::build().map_err(EpisodeError::Build)
}
