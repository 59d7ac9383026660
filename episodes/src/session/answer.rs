//! Execution of tool calls: observations, commands, and calls about the episode as a whole.

use tandem_sim::{Pose, Side};
use tandem_tools_spec::{
    ActCall, Call, CommandReply, EndReason, Formats, Look, LookCall, LookReply, ManageCall, ManageReply,
    Observe, PoseFrame, RobotReport, RobotState, SpecError, StatusReply, StopReason, TalkCall, TalkReply,
    ToolCall, ToolReply,
};

use super::Session;
use crate::EpisodeError;
use crate::commands::{self, Allowed, Called, Command, Motion, RobotSheet, check_reach, report};
use crate::convert::wire_pose;
use crate::observation::{
    Detail, Proprioception, TeamObservation, check_formats, robot_state, samples, tell_state_in,
};
use crate::recording::CallOutcome;

/// The answer to a call, with views not yet encoded.
#[derive(Clone)]
pub enum Answer {
    Reply(Box<ToolReply>),
    Observation(TeamObservation),
}

impl Answer {
    /// Returns the reply for the caller, with views encoded in `formats`.
    pub fn reply(self, formats: &Formats) -> Result<ToolReply, EpisodeError> {
        match self {
            Answer::Reply(reply) => Ok(*reply),
            Answer::Observation(seen) => Ok(ToolReply::Look(LookReply::Observe(seen.reply(formats)?))),
        }
    }
}

impl From<ToolReply> for Answer {
    fn from(reply: ToolReply) -> Answer {
        Answer::Reply(Box::new(reply))
    }
}

impl<'a> From<&'a Answer> for CallOutcome<'a> {
    fn from(answer: &'a Answer) -> CallOutcome<'a> {
        match answer {
            Answer::Reply(reply) => CallOutcome::Reply(reply),
            Answer::Observation(seen) => CallOutcome::Observation(seen),
        }
    }
}

impl Session {
    /// Answers a call of the operator of a robot, or of the policy that directs all robots.
    pub(super) fn answer(
        &mut self,
        operator: Option<&str>,
        allowed: Allowed,
    ) -> Result<Answer, EpisodeError> {
        let call = match allowed.called() {
            Called::One(call) => call,
            Called::Together(calls) => {
                self.expect_underway()?;
                let orders = calls.iter().map(|call| call.order(&self.rules, &self.motions));
                let command = Command::together(orders.collect::<Result<_, _>>()?);
                return self.act(&command);
            }
        };
        match &call.tool {
            ToolCall::Look(look) => self.look(look, call),
            ToolCall::Act(act) => {
                self.expect_underway()?;
                let command = Command::read(act, &self.rules, &self.motions)?;
                self.act(&command)
            }
            ToolCall::Plan(_) => {
                self.expect_underway()?;
                Err(EpisodeError::Spec(SpecError::Invalid {
                    tool: call.name(),
                    reason: "its commands are made and recorded one by one".into(),
                }))
            }
            ToolCall::Manage(manage) => Ok(ToolReply::Manage(self.manage(operator, manage)).into()),
            ToolCall::Talk(TalkCall::Say(_)) => {
                self.expect_underway()?;
                Ok(ToolReply::Talk(TalkReply::Say(self.status())).into())
            }
        }
    }

    /// Returns an error if the episode has ended.
    pub(super) fn expect_underway(&self) -> Result<(), EpisodeError> {
        match self.ended {
            Some(reason) => {
                let result = self.result().disclosed(self.spec().disclosure).into();
                Err(EpisodeError::Ended { reason, result })
            }
            None => Ok(()),
        }
    }

    fn look(&mut self, look: &LookCall, call: &Call) -> Result<Answer, EpisodeError> {
        let find = |name: &String| commands::find(name, &self.motions);
        let reply = match look {
            LookCall::Observe(args) => {
                let mut seen = self.seen(args, &call.formats)?;
                if call.samples {
                    for state in seen.robots.iter_mut().map(|observed| &mut observed.state) {
                        let robot = commands::find(&state.robot, &self.motions)?;
                        state.samples = Some(samples(self.world.robots()[robot].readings()));
                    }
                }
                return Ok(Answer::Observation(seen));
            }
            LookCall::GetRobotState(args) => {
                let robot = find(&args.robot)?;
                let motion = &self.motions[robot];
                let own = Proprioception::of(&self.present, robot);
                let mut state = robot_state(&own, &motion.robot, Detail::Full);
                tell_state_in(&mut state, args.frame, &motion.pelvis_from(args.frame), own.sensed);
                tell_targets(&mut state, motion);
                state.samples = call.samples.then(|| samples(self.world.robots()[robot].readings()));
                LookReply::GetRobotState(state)
            }
            LookCall::QueryDepth(args) => {
                let robot = find(&args.robot)?;
                let motion = &self.motions[robot];
                let frame = (args.frame, motion.pelvis_from(args.frame));
                let name = &motion.robot.name;
                LookReply::QueryDepth(match &args.surface {
                    Some(query) => {
                        let level = motion.pelvis_from(PoseFrame::Level);
                        self.observer.surface(&self.present, robot, name, query, frame, &level)?
                    }
                    None => match &args.region {
                        Some(region) if args.fit => {
                            self.observer.fit(&self.present, robot, name, region, frame)?
                        }
                        _ => self.observer.depth(&self.present, robot, name, &args.named(), frame)?,
                    },
                })
            }
            LookCall::CheckReach(args) => {
                let robot = find(&args.robot)?;
                LookReply::CheckReach(check_reach(args, &self.motions[robot]))
            }
        };
        Ok(ToolReply::Look(reply).into())
    }

    /// Observes the requested robots.
    fn seen(&mut self, args: &Observe, formats: &Formats) -> Result<TeamObservation, EpisodeError> {
        let robots = self.looked_through(args, formats)?;
        let sheets: Vec<&RobotSheet> = self.motions.iter().map(|motion| &motion.robot).collect();
        let mut seen = self.observer.observe(&self.present, &robots, &sheets, Detail::of(args));
        for (observed, robot) in seen.robots.iter_mut().zip(robots) {
            let motion = &self.motions[robot];
            if let Some(frame) = args.frame {
                let sensed = &self.present.robots[robot].sensed;
                observed.tell_in(frame, &motion.pelvis_from(frame), sensed);
            }
            tell_targets(&mut observed.state, motion);
        }
        seen.shows_depth = args.depth_image;
        Ok(seen)
    }

    /// Checks that an observation is valid and requests no withheld data.
    pub(super) fn check_look(&self, look: &Look) -> Result<(), EpisodeError> {
        self.check_told(&look.observe.clone().into())?;
        self.looked_through(&look.observe, &look.formats).map(drop)
    }

    fn looked_through(&self, args: &Observe, formats: &Formats) -> Result<Vec<usize>, EpisodeError> {
        check_formats(formats, self.spec().protocol)?;
        match &args.robots {
            Some(names) => names.iter().map(|name| commands::find(name, &self.motions)).collect(),
            None => Ok((0..self.motions.len()).collect()),
        }
    }

    fn manage(&mut self, operator: Option<&str>, call: &ManageCall) -> ManageReply {
        match call {
            ManageCall::GetStatus(asked) => {
                let next_phase = if asked.explain { self.next_phase(operator) } else { None };
                ManageReply::GetStatus(StatusReply { next_phase, ..self.status() })
            }
            ManageCall::Finish(_) => {
                self.ended.get_or_insert(EndReason::Finished);
                ManageReply::Finish(self.result().disclosed(self.spec().disclosure))
            }
        }
    }

    /// Executes a command and reports on every robot with an order in it.
    fn act(&mut self, command: &Command) -> Result<Answer, EpisodeError> {
        let began: Vec<Pose> =
            self.present.robots.iter().map(|robot| robot.sensed.start_from_pelvis).collect();
        let (executed_steps, clamped) = self.run(command)?;
        let stop_reason = self.stop_reason();
        let robots: Vec<RobotReport> = command
            .orders
            .iter()
            .zip(&clamped)
            .map(|(order, clamped)| {
                let sensed = &self.present.robots[order.robot].sensed;
                report(clamped, &began[order.robot], sensed, &self.motions[order.robot])
            })
            .collect();
        Ok(ToolReply::Act(CommandReply {
            executed_steps,
            stop_reason,
            time_s: self.present.time_s,
            robots,
            fallen: self.told_fallen(),
            phases: self.phases(),
            budget: self.budget(),
        })
        .into())
    }

    /// Executes a checked command without a report.
    pub(super) fn carry_out_unreported(&mut self, act: &ActCall) -> Result<(), EpisodeError> {
        let command = Command::read(act, &self.rules, &self.motions)?;
        self.run(&command)?;
        self.stop_reason();
        Ok(())
    }

    /// Returns the reason why an executed command stopped, and ends the episode if that reason does so.
    fn stop_reason(&mut self) -> StopReason {
        if self.has_succeeded() {
            self.ended = Some(EndReason::TaskComplete);
            StopReason::TaskComplete
        } else if self.steps_left() == 0 {
            self.ended = Some(EndReason::StepBudgetExhausted);
            StopReason::StepBudgetExhausted
        } else {
            StopReason::StepsDone
        }
    }
}

/// Adds the commanded poses of wrists that have one, in the frame of the state.
fn tell_targets(state: &mut RobotState, motion: &Motion) {
    let frame_from_pelvis = motion.pelvis_from(state.frame.unwrap_or_default()).inverse();
    let wrists = motion.wrists();
    let target =
        |side: Side| motion.aims_at_pose(side).then(|| wire_pose(&(frame_from_pelvis * wrists[side].target)));
    (state.left_wrist_target, state.right_wrist_target) = (target(Side::Left), target(Side::Right));
}
