//! Plans: several commands in one call. Each command is made, counted and recorded by itself, so a
//! recording contains no plans.
//!
//! A [`PlanRun`] returns the next command and receives its reply. It serves both a plan of the policy of all
//! robots, and an operator's plan, whose commands pass through the team's rounds.

mod carry;
mod commands;
mod expectation;
mod outcomes;
mod pace;
mod pieces;
mod walk_to;
mod walkers;
mod way;

use tandem_tools_spec::{
    ActCall, Call, CommandReply, Formats, Partner, PlanCall, PlanReply, PoseFrame, SendPlan, SpecError,
    StopReason, Tool as _, ToolCall, ToolReply, WalkTo,
};

use super::Session;
use super::journal::KeptRequest;
use super::told::shorten_plan;
use crate::EpisodeError;
use crate::commands::{Called, OperatorCall, report_wrists_in};
use crate::output::OutputError;
use crate::recording::CallerRecord;
use commands::CommandList;
use expectation::{PartnerNews, all_wait};
use outcomes::Outcomes;
use walkers::Walkers;

/// A plan in execution.
#[derive(Debug)]
pub struct PlanRun {
    stage: PlanStage,
    progress: PlanProgress,
    /// News from the other operators.
    news: PartnerNews,
    /// Robot of the plan's operator; `None` for the policy of all robots.
    operator: Option<String>,
}

/// Next step of a plan.
#[derive(Debug)]
pub enum PlanAdvance {
    /// The next command; its reply is passed to [`PlanRun::take`].
    Make(ActCall),
    /// The end, with the reason if the plan stopped early.
    Done(Option<String>),
}

#[derive(Debug)]
enum PlanStage {
    Commands(CommandList),
    Walk(Walkers),
}

/// The executed part of a plan.
#[derive(Debug, Default)]
struct PlanProgress {
    replies: u32,
    executed_steps: u32,
    outcomes: Outcomes,
    last: Option<CommandReply>,
    /// True while the last reply is not among the outcomes.
    is_new: bool,
}

impl PlanRun {
    /// Returns the next command of the plan.
    pub fn advance(&mut self, session: &Session) -> PlanAdvance {
        self.digest(session);
        let last = self.progress.last.as_ref();
        match &mut self.stage {
            PlanStage::Commands(list) => list.advance(session, last, &self.news),
            PlanStage::Walk(walk) => walk.advance(session, last, &self.news),
        }
    }

    /// Processes the reply to the last command. Returns the reason why the plan stops, if the episode has
    /// ended or a robot has fallen.
    pub fn take(&mut self, reply: CommandReply) -> Option<String> {
        self.progress.replies += 1;
        self.progress.executed_steps += reply.executed_steps;
        let (stop, falls) = (reply.stop_reason, reply.fallen.iter().any(|robot| robot.fallen));
        (self.progress.last, self.progress.is_new) = (Some(reply), true);
        match stop {
            StopReason::StepsDone | StopReason::PartnerDone => falls.then(|| "a robot has fallen".into()),
            StopReason::TaskComplete => Some("the task is complete".into()),
            StopReason::StepBudgetExhausted => Some("the episode's steps are used up".into()),
        }
    }

    /// Converts the last reply to the frame of the walk that it belongs to, and adds it to the outcomes.
    fn digest(&mut self, session: &Session) {
        let frame = match &self.stage {
            PlanStage::Commands(list) => list.frame(),
            PlanStage::Walk(walk) => Some(walk.frame),
        };
        let Some(last) = self.progress.last.as_mut().filter(|_| self.progress.is_new) else { return };
        if let Some(frame) = frame {
            session.tell_in(frame, last);
        }
        if let PlanStage::Commands(list) = &self.stage {
            self.progress.outcomes.add(list.place(), last, |robot, side| list.is_under_way(robot, side));
        }
        self.progress.is_new = false;
    }

    /// Returns the tool of the command that is carried out.
    pub fn tool(&self) -> &'static str {
        match &self.stage {
            PlanStage::Commands(list) => list.tool(),
            PlanStage::Walk(_) => WalkTo::NAME,
        }
    }

    /// Registers a message from the operator of another robot.
    pub fn hear(&mut self, from: &str) {
        self.news.heard.insert(from.into());
    }

    /// Registers the actions of the other operators during the last command.
    pub fn see(&mut self, partners: &[Partner]) {
        self.news.partners_wait = all_wait(partners);
    }

    /// Returns true while no command has been executed.
    pub fn is_untouched(&self) -> bool {
        self.progress.last.is_none()
    }

    /// Returns the reply to a plan with at least one executed command.
    fn reply(mut self, session: &Session, stopped: Option<String>) -> Result<PlanReply, EpisodeError> {
        self.digest(session);
        let tool_calls = session.tool_calls;
        let PlanProgress { replies, executed_steps, outcomes, last, is_new: _ } = self.progress;
        let (commands, is_short) = match &self.stage {
            PlanStage::Commands(list) => (list.begun(), list.is_short()),
            PlanStage::Walk(_) => (replies, false),
        };
        let carried_in = match &self.stage {
            PlanStage::Commands(list) => list.carried_in(),
            PlanStage::Walk(walk) => walk.carried_in(),
        };
        let operator = self.operator.as_deref();
        let held = carried_in.map_or(Vec::new(), |frame| session.held(&session.facts(), operator, frame));
        let last = last.ok_or_else(|| SpecError::Invalid {
            tool: SendPlan::NAME,
            reason: "no command was made; give at least one".into(),
        })?;
        let (tool_calls, outcomes) = (Some(tool_calls), outcomes.lines());
        let mut reply = PlanReply { commands, tool_calls, executed_steps, stopped, outcomes, held, last };
        if is_short {
            shorten_plan(&mut reply);
        }
        Ok(reply)
    }
}

impl Session {
    /// Executes a plan of the policy of all robots, or refuses it as a whole.
    pub(super) fn plan(&mut self, caller: CallerRecord, plan: &PlanCall) -> Result<PlanReply, EpisodeError> {
        let call = ToolCall::Plan(plan.clone());
        let run = self.begin_or_refuse(caller, &Called::from(call.clone()), plan)?;
        self.count_request();
        self.planning = true;
        let reply = self.carry_out_plan(caller, run);
        self.planning = false;
        self.tell_plan(caller.operator(), &call, reply.as_ref())?;
        if self.ended.is_some() {
            self.settle();
        }
        reply
    }

    /// Starts a plan of an operator, whose commands are executed together with the other operators' commands.
    /// A refusal is counted and recorded like that of any call.
    pub fn begin_plan(&mut self, operator: &OperatorCall, plan: &PlanCall) -> Result<PlanRun, EpisodeError> {
        let arrival = self.arrival(|| KeptRequest::command(operator));
        let caller = CallerRecord::Operator(operator.robot());
        let called = Called::Together(vec![operator.clone()]);
        match self.begin_or_refuse(caller, &called, plan) {
            Ok(run) => {
                self.count_request();
                Ok(run)
            }
            Err(refusal) => {
                self.write_down(arrival);
                Err(refusal)
            }
        }
    }

    /// Returns the reply to an operator's finished plan, and shows the full reply to viewers. The returned
    /// reply is short if the call requested that.
    pub fn end_plan(
        &mut self,
        call: &Call,
        run: PlanRun,
        stopped: Option<String>,
    ) -> Result<PlanReply, EpisodeError> {
        let operator = run.operator.clone();
        let reply = run.reply(self, stopped);
        self.tell_plan(operator.as_deref(), &call.tool, reply.as_ref())?;
        let mut reply = reply?;
        if call.short {
            shorten_plan(&mut reply);
        }
        Ok(reply)
    }

    fn begin_or_refuse(
        &mut self,
        caller: CallerRecord,
        called: &Called,
        plan: &PlanCall,
    ) -> Result<PlanRun, EpisodeError> {
        let allowed = self.allow(called).and_then(|_| self.expect_underway());
        let begun = allowed.and_then(|()| match plan {
            PlanCall::SendPlan(plan) => self.command_list(plan, caller.operator()).map(PlanStage::Commands),
            PlanCall::WalkTo(walk) => self.walkers(walk, caller.operator()).map(PlanStage::Walk),
        });
        match begun {
            Ok(stage) => {
                let operator = caller.operator().map(str::to_owned);
                Ok(PlanRun {
                    stage,
                    progress: PlanProgress::default(),
                    news: PartnerNews::default(),
                    operator,
                })
            }
            Err(refusal) => {
                self.refuse(caller, called, &refusal);
                Err(refusal)
            }
        }
    }

    fn carry_out_plan(&mut self, caller: CallerRecord, mut run: PlanRun) -> Result<PlanReply, EpisodeError> {
        let stopped = loop {
            let call = match run.advance(self) {
                PlanAdvance::Make(call) => call,
                PlanAdvance::Done(stopped) => break stopped,
            };
            let made = self.make(caller, &Called::from(ToolCall::Act(call)));
            let stopped = match made.and_then(|answer| answer.reply(&Formats::default())) {
                Ok(ToolReply::Act(reply)) => run.take(reply),
                Ok(other) => Some(format!("{other:?} is no reply to a command")),
                // An error in the first command refuses the plan.
                Err(error) if run.is_untouched() => return Err(error),
                Err(error) => Some(error.to_string()),
            };
            if stopped.is_some() {
                break stopped;
            }
        };
        run.reply(self, stopped)
    }

    /// Converts the wrists in the reply to the last command to `frame`.
    fn tell_in(&self, frame: PoseFrame, reply: &mut CommandReply) {
        for (motion, robot) in self.motions.iter().zip(&self.present.robots) {
            if let Some(report) = reply.robots.iter_mut().find(|report| report.robot == motion.robot.name) {
                report_wrists_in(frame, report, &robot.sensed, motion);
            }
        }
    }

    /// Records the plan after its commands, for readers of the requests.
    fn tell_plan(
        &mut self,
        operator: Option<&str>,
        call: &ToolCall,
        reply: Result<&PlanReply, &EpisodeError>,
    ) -> Result<(), EpisodeError> {
        let arguments = serde_json::to_string(call).map_err(OutputError::from)?;
        let told = match reply {
            Ok(reply) => Ok(serde_json::to_string(reply).map_err(OutputError::from)?),
            Err(refusal) => Err(refusal.to_string()),
        };
        let told = told.as_deref().map_err(String::as_str);
        self.tell_beside(operator, call.name(), &arguments, told);
        Ok(())
    }
}
