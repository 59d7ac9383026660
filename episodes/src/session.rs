//! An episode: a world, its rules, and the tool calls that act on it. Synchronous; it lives on a thread of its own.

use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

use tandem_sim::{ObjectPlacement, Pose, RobotCommand, RobotPlacement, Rotation, Snapshot, World, WorldSpec};
use tandem_tools_spec::{
    ActCall, Briefing, Budget, CommandReply, EndReason, LookCall, LookReply, ManageCall, ManageReply,
    PhaseReached, PhaseTimes, Protocol, ResultReply, RobotFallen, StatusReply, StopReason, ToolCall,
    ToolReply,
};

use crate::convert::rounded;
use crate::describe;
use crate::facts::Facts;
use crate::motion::{Motion, MotionState, Plan, UpperBody};
use crate::observe::{Eyes, robot_state};
use crate::phases::PhaseTracker;
use crate::plan;
use crate::protocol::{Clock, Rules, ThinkingClock, monotonic, rules};
use crate::run_files::RunFiles;
use crate::scorekeeper::Scorekeeper;
use crate::tasks::Task;
use crate::{EpisodeError, LocomotionChoice};

/// One episode from start to result.
pub struct Session {
    task: &'static Task,
    seed: u32,
    protocol: Protocol,
    rules: Rules,
    world: World,
    motions: Vec<Motion>,
    scores: Scores,
    clock: ThinkingClock,
    eyes: Eyes,
    files: Option<RunFiles>,
    tool_calls: u32,
    /// Time that physics took, for the real-time factor.
    physics: Duration,
    ended: Option<EndReason>,
}

/// What scoring remembers from step to step.
#[derive(Clone)]
struct Scores {
    keeper: Scorekeeper,
    phases: PhaseTracker,
}

/// An episode at one instant, for going on from there later with the same task, seed and binary.
#[derive(Clone)]
pub struct Checkpoint {
    world: Snapshot,
    motions: Vec<MotionState>,
    scores: Scores,
    tool_calls: u32,
    thought: Duration,
    ended: Option<EndReason>,
}

impl Session {
    /// Builds the world of `task` under `seed`, with robots that walk by `locomotion`, and runs the initial hold. With a folder, the episode is recorded there.
    pub fn start(
        task: &'static Task,
        seed: u32,
        protocol: Protocol,
        locomotion: &LocomotionChoice,
        folder: Option<&Path>,
    ) -> Result<Session, EpisodeError> {
        Session::start_with_clock(task, seed, protocol, locomotion, folder, monotonic())
    }

    /// As [`Session::start`], with the policy's wall clock read from `clock`.
    pub fn start_with_clock(
        task: &'static Task,
        seed: u32,
        protocol: Protocol,
        locomotion: &LocomotionChoice,
        folder: Option<&Path>,
        clock: Clock,
    ) -> Result<Session, EpisodeError> {
        let mut world = World::new(&world_spec(task, seed))?;
        for robot in 0..world.robots().len() {
            world.set_locomotion(robot, locomotion.controller());
        }
        let rest = world.rest_command(0);
        let body = UpperBody::new(tandem_sim::assets::robot(tandem_sim::assets::DEFAULT_ROBOT)?, &rest)?;
        let body = Arc::new(body);
        let motions =
            (0..world.robots().len()).map(|robot| Motion::new(&body, &world.rest_command(robot))).collect();
        let rules = rules(protocol, task);
        let files = match folder {
            Some(folder) => Some(RunFiles::create(folder, task, seed, protocol, locomotion.name(), &world)?),
            None => None,
        };
        let mut session = Session {
            task,
            seed,
            protocol,
            rules,
            motions,
            scores: Scores { keeper: Scorekeeper::new(task, &world), phases: PhaseTracker::new(task) },
            world,
            clock: ThinkingClock::new(rules.thinking, clock),
            eyes: Eyes::default(),
            files,
            tool_calls: 0,
            physics: Duration::ZERO,
            ended: None,
        };
        session.keep_picture("start")?;
        let holds: Vec<Plan> = session.motions.iter().map(Motion::hold).collect();
        if rules.initial_hold_steps > 0 {
            session.run(holds, rules.initial_hold_steps)?;
        }
        session.clock.resume();
        Ok(session)
    }

    /// Answers a tool call. An error changes nothing but the count of calls.
    pub fn call(&mut self, call: ToolCall) -> Result<ToolReply, EpisodeError> {
        self.clock.pause();
        if self.ended.is_none() && self.clock.exhausted() {
            self.ended = Some(EndReason::WallClockExhausted);
        }
        let answer = call.validate().map_err(EpisodeError::from).and_then(|()| self.answer(&call));
        self.tool_calls += 1;
        if let Some(files) = &mut self.files {
            files.tool_call(self.world.time_s(), &call, &answer)?;
        }
        self.clock.resume();
        answer
    }

    fn answer(&mut self, call: &ToolCall) -> Result<ToolReply, EpisodeError> {
        match (call, self.ended) {
            (ToolCall::Manage(call), _) => Ok(ToolReply::Manage(self.manage(call))),
            (ToolCall::Look(_) | ToolCall::Act(_), Some(reason)) => Err(EpisodeError::Ended { reason }),
            (ToolCall::Look(call), None) => self.look(call).map(ToolReply::Look),
            (ToolCall::Act(call), None) => self.act(call).map(ToolReply::Act),
        }
    }

    fn look(&mut self, call: &LookCall) -> Result<LookReply, EpisodeError> {
        match call {
            LookCall::Observe(args) => {
                let robots = match &args.robots {
                    Some(names) => names.iter().map(|name| self.robot(name)).collect::<Result<_, _>>()?,
                    None => (0..self.motions.len()).collect::<Vec<_>>(),
                };
                self.eyes.observe(&self.world, &robots).map(LookReply::Observe)
            }
            LookCall::GetRobotState(args) => {
                let robot = self.robot(&args.robot)?;
                Ok(LookReply::GetRobotState(robot_state(&self.world, robot)))
            }
            LookCall::QueryDepth(args) => {
                let robot = self.robot(&args.robot)?;
                self.eyes.depth(&self.world, robot, &args.pixels).map(LookReply::QueryDepth)
            }
            LookCall::CheckReach(args) => {
                let robot = self.robot(&args.robot)?;
                Ok(LookReply::CheckReach(plan::check_reach(args, &self.motions[robot])))
            }
        }
    }

    fn manage(&mut self, call: &ManageCall) -> ManageReply {
        match call {
            ManageCall::GetStatus(_) => ManageReply::GetStatus(self.status()),
            ManageCall::Finish(_) => {
                self.ended.get_or_insert(EndReason::Finished);
                ManageReply::Finish(self.result())
            }
        }
    }

    fn robot(&self, name: &str) -> Result<usize, EpisodeError> {
        let names: Vec<&'static str> = self.task.robots.iter().map(|robot| robot.name).collect();
        let index = names.iter().position(|known| *known == name);
        index.ok_or_else(|| EpisodeError::UnknownRobot { name: name.into(), have: names })
    }

    /// Checks a command as a whole, then executes it.
    fn act(&mut self, call: &ActCall) -> Result<CommandReply, EpisodeError> {
        let asked = plan::steps(call);
        if asked == 0 || asked > self.rules.steps_per_command as usize {
            return Err(EpisodeError::TooManySteps {
                asked,
                most: self.rules.steps_per_command,
                protocol: plan::protocol_name(self.protocol),
            });
        }
        let mut orders = Vec::with_capacity(self.motions.len());
        for name in plan::named_robots(call) {
            let robot = self.robot(name)?;
            orders.push((robot, plan::order(call, name, &self.world.robots()[robot], &self.motions[robot])));
        }
        let mut plans: Vec<Plan> = self.motions.iter().map(Motion::hold).collect();
        for (robot, order) in &orders {
            plans[*robot] = order.plan.clone();
        }
        let steps = (asked as u32).min(self.steps_left());
        let executed_steps = self.run(plans, steps)?;
        let stop_reason = if self.scores.phases.complete() {
            self.ended = Some(EndReason::TaskComplete);
            StopReason::TaskComplete
        } else if self.steps_left() == 0 {
            self.ended = Some(EndReason::StepBudgetExhausted);
            StopReason::StepBudgetExhausted
        } else {
            StopReason::StepsDone
        };
        let reports = orders.iter().map(|(robot, order)| {
            plan::report(
                order,
                &self.world.robots()[*robot],
                &self.world.robot_state(*robot),
                &self.motions[*robot],
            )
        });
        Ok(CommandReply {
            executed_steps,
            stop_reason,
            time_s: self.world.time_s(),
            robots: reports.collect(),
            fallen: self.fallen(),
            phases: self.phases(),
            budget: self.budget(),
        })
    }

    /// Executes up to `steps` control steps; fewer if the last phase is reached. Returns how many.
    fn run(&mut self, plans: Vec<Plan>, steps: u32) -> Result<u32, EpisodeError> {
        let mut runs: Vec<_> = plans
            .into_iter()
            .zip(&mut self.motions)
            .map(|(plan, motion)| motion.begin(plan, steps))
            .collect();
        for step in 1..=steps {
            let started = Instant::now();
            let commands: Vec<RobotCommand> =
                runs.iter_mut().zip(&mut self.motions).map(|(run, motion)| run.command(motion)).collect();
            self.world.control_step(&commands);
            self.scores.keeper.update(&self.world);
            self.physics += started.elapsed();
            let facts = self.facts();
            let was_underway = self.scores.phases.underway();
            let reached = self.scores.phases.update(&facts);
            let budget = self.budget();
            if let Some(files) = &mut self.files {
                files.step(&self.world, &commands, &facts, budget)?;
            }
            if reached {
                self.phase_reached()?;
            } else if self.scores.phases.underway() && !was_underway {
                self.keep_picture("together")?;
            }
            if self.scores.phases.complete() {
                return Ok(step);
            }
        }
        Ok(steps)
    }

    fn phase_reached(&mut self) -> Result<(), EpisodeError> {
        let Some(phase) = self.phases().pop() else { return Ok(()) };
        self.keep_picture(&format!("{} {}", phase.id, phase.name.replace('_', " ")))?;
        if let Some(files) = &mut self.files {
            files.phase(&phase)?;
        }
        Ok(())
    }

    /// Keeps a picture of this moment for the strip, if the episode is recorded.
    fn keep_picture(&mut self, caption: &str) -> Result<(), EpisodeError> {
        if let Some(files) = &mut self.files {
            files.keep_picture(caption, &self.world, &mut self.eyes)?;
        }
        Ok(())
    }

    /// What has to be known to begin.
    pub fn briefing(&self) -> Briefing {
        Briefing {
            instruction: self.task.instruction.into(),
            instructions: describe::instructions(self.task),
            robots: describe::robots(&self.world),
            action_row: describe::action_row(&self.world.robots()[0].model),
            status: self.status(),
        }
    }

    /// What scoring and experts see.
    pub fn facts(&self) -> Facts {
        self.scores.keeper.facts(&self.world)
    }

    /// Why the episode has ended, if it has.
    pub fn ended(&self) -> Option<EndReason> {
        self.ended
    }

    /// Equal for equal physical states, 16 hexadecimal digits.
    pub fn state_hash(&self) -> String {
        format!("{:016x}", self.world.state_hash())
    }

    fn steps_left(&self) -> u32 {
        self.rules.episode_steps.saturating_sub(self.world.control_steps() as u32)
    }

    fn budget(&self) -> Budget {
        Budget {
            steps_left: self.steps_left(),
            wall_clock_left_s: self.clock.left().map(|left| rounded(left.as_secs_f64())),
            steps_per_command: self.rules.steps_per_command,
        }
    }

    fn fallen(&self) -> Vec<RobotFallen> {
        let robots = self.world.robots().iter().enumerate();
        let fallen = |index| self.world.robot_state(index).fallen;
        robots
            .map(|(index, robot)| RobotFallen { robot: robot.name.clone(), fallen: fallen(index) })
            .collect()
    }

    fn phases(&self) -> Vec<PhaseReached> {
        let reached = self.scores.phases.reached().enumerate();
        reached
            .map(|(index, (phase, time_s))| PhaseReached {
                id: describe::phase_id(index),
                name: phase.id.into(),
                time_s,
            })
            .collect()
    }

    fn status(&self) -> StatusReply {
        StatusReply {
            task: self.task.id.into(),
            seed: self.seed,
            protocol: self.protocol,
            time_s: self.world.time_s(),
            env_steps: self.world.control_steps() as u32,
            ended: self.ended,
            fallen: self.fallen(),
            phases: self.phases(),
            budget: self.budget(),
            state_hash: self.state_hash(),
        }
    }

    /// The result as it stands.
    pub fn result(&self) -> ResultReply {
        let reached = self.phases();
        let time_s = |id: &str| reached.iter().find(|phase| phase.id == id).map(|phase| phase.time_s);
        let phases = (0..self.task.phases.len()).map(describe::phase_id).map(|id| {
            let reached_s = time_s(&id);
            (id, reached_s)
        });
        let physics_s = self.physics.as_secs_f64();
        ResultReply {
            task: self.task.id.into(),
            seed: self.seed,
            protocol: self.protocol,
            phases: PhaseTimes(phases.collect()),
            ended: self.ended.unwrap_or(EndReason::Finished),
            env_steps: self.world.control_steps() as u32,
            tool_calls: self.tool_calls,
            falls: self.fallen().iter().filter(|robot| robot.fallen).count() as u32,
            realtime_factor: if physics_s > 0.0 { self.world.time_s() / physics_s } else { 0.0 },
            state_hash: self.state_hash(),
        }
    }

    /// Ends the episode and writes what a recorded one leaves behind.
    pub fn close(mut self) -> Result<ResultReply, EpisodeError> {
        self.ended.get_or_insert(EndReason::Finished);
        if !self.scores.phases.complete() {
            self.keep_picture("end")?;
        }
        let result = self.result();
        if let Some(files) = self.files {
            files.finish(&result, self.task)?;
        }
        Ok(result)
    }

    /// The episode as it stands.
    pub fn checkpoint(&self) -> Result<Checkpoint, EpisodeError> {
        Ok(Checkpoint {
            world: self.world.snapshot()?,
            motions: self.motions.iter().map(|motion| motion.state().clone()).collect(),
            scores: self.scores.clone(),
            tool_calls: self.tool_calls,
            thought: self.clock.spent(),
            ended: self.ended,
        })
    }

    /// Takes the episode to a checkpoint of an episode of the same task and seed.
    pub fn resume(&mut self, checkpoint: &Checkpoint) -> Result<(), EpisodeError> {
        self.world.restore(&checkpoint.world)?;
        for (motion, state) in self.motions.iter_mut().zip(&checkpoint.motions) {
            motion.set_state(state.clone());
        }
        self.scores = checkpoint.scores.clone();
        self.tool_calls = checkpoint.tool_calls;
        self.clock.set_spent(checkpoint.thought);
        self.ended = checkpoint.ended;
        self.eyes.forget();
        Ok(())
    }
}

fn world_spec(task: &Task, seed: u32) -> WorldSpec {
    let robots = task.robots.iter().map(|robot| RobotPlacement {
        name: robot.name.into(),
        position_m: robot.position_m,
        yaw_rad: robot.yaw_rad,
    });
    let objects = task.objects.iter().zip(task.starts(seed)).map(|(spot, start)| ObjectPlacement {
        name: spot.name.into(),
        file: spot.file.into(),
        world_from_object: Pose::from_parts(
            start.position_m.into(),
            Rotation::from_rotation_z(start.yaw_rad),
        ),
    });
    WorldSpec { scene: task.scene.into(), robots: robots.collect(), objects: objects.collect() }
}
