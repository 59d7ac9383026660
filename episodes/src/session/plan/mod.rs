//! Several commands by one call. Each is made, counted and recorded by itself, so that a recording holds nothing of plans.

mod carry;
mod walk_to;
mod way;

use tandem_tools_spec::{
    ActCall, BaseState, CommandReply, Expectation, Formats, HandReport, HandState, PlanCall, PlanReply,
    PlanStep, RobotReport, SendPlan, SpecError, StopReason, Tool as _, ToolCall, ToolReply,
};

use super::Session;
use super::told::shorten_report;
use crate::EpisodeError;
use crate::commands::{Called, Command};
use crate::output::OutputError;
use crate::recording::CallerRecord;
use crate::scoring::Phase;

/// What has been carried out of a plan.
#[derive(Default)]
struct PlanProgress {
    commands: u32,
    executed_steps: u32,
    last: Option<CommandReply>,
    /// Whether the last reply was asked for as a short one.
    is_short: bool,
}

impl Session {
    /// Carries out a plan, or refuses all of it.
    pub(super) fn plan(&mut self, caller: CallerRecord, plan: &PlanCall) -> Result<PlanReply, EpisodeError> {
        let call = ToolCall::Plan(plan.clone());
        let called = Called::from(call.clone());
        let allowed = self.allow(&called).and_then(|_| self.expect_underway());
        let checked = allowed.and_then(|()| match plan {
            PlanCall::SendPlan(plan) => self.check_commands(plan),
            PlanCall::WalkTo(walk) => self.check_destinations(walk),
        });
        if let Err(refusal) = checked {
            self.refuse(caller, &called, &refusal);
            return Err(refusal);
        }
        self.count_request();
        self.planning = true;
        let reply = match plan {
            PlanCall::SendPlan(plan) => self.carry_out_commands(caller, plan),
            PlanCall::WalkTo(walk) => self.walk_to(caller, walk),
        };
        self.planning = false;
        self.tell_plan(caller, &call, &reply)?;
        if self.ended.is_some() {
            self.settle();
        }
        reply
    }

    /// Tells the plan behind its commands, for who reads what was asked.
    fn tell_plan(
        &mut self,
        caller: CallerRecord,
        call: &ToolCall,
        reply: &Result<PlanReply, EpisodeError>,
    ) -> Result<(), EpisodeError> {
        let arguments = serde_json::to_string(call).map_err(OutputError::from)?;
        let told = match reply {
            Ok(reply) => Ok(serde_json::to_string(reply).map_err(OutputError::from)?),
            Err(refusal) => Err(refusal.to_string()),
        };
        let told = told.as_deref().map_err(String::as_str);
        self.tell_beside(caller.operator(), call.name(), &arguments, told);
        Ok(())
    }

    fn check_commands(&self, plan: &SendPlan) -> Result<(), EpisodeError> {
        for (index, PlanStep { call, expects, .. }) in plan.calls()?.iter().enumerate() {
            Command::read(call, &self.rules, &self.motions)?;
            let phases = self.spec().task.phases.iter().enumerate();
            let numbered = phases.map(|(number, phase)| (Phase::number(number), phase.id));
            let is_known = |name: &String| numbered.clone().any(|(number, id)| *name == number || name == id);
            if let Some(name) = expects.phase_reached.as_ref().filter(|name| !is_known(name)) {
                let have: Vec<String> =
                    numbered.clone().map(|(number, id)| format!("{number} ({id})")).collect();
                let reason =
                    format!("{}: there is no phase {name:?}; have: {}", plan.place(index), have.join(", "));
                return Err(SpecError::Invalid { tool: SendPlan::NAME, reason }.into());
            }
        }
        Ok(())
    }

    fn carry_out_commands(
        &mut self,
        caller: CallerRecord,
        plan: &SendPlan,
    ) -> Result<PlanReply, EpisodeError> {
        let mut progress = PlanProgress::default();
        for (index, PlanStep { call, expects, short }) in plan.calls()?.into_iter().enumerate() {
            progress.is_short = short;
            let why = match self.make_planned(caller, call, &mut progress)? {
                Ok(reply) => unexpected(&expects, reply),
                Err(why) => Some(why),
            };
            if let Some(why) = why {
                return self.plan_reply(progress, Some(format!("after {}: {why}", plan.place(index))));
            }
        }
        self.plan_reply(progress, None)
    }

    /// The reply to a plan of which at least one command has been made, and why no more were.
    fn plan_reply(&self, progress: PlanProgress, stopped: Option<String>) -> Result<PlanReply, EpisodeError> {
        let PlanProgress { commands, executed_steps, last, is_short } = progress;
        let mut last = last.ok_or_else(|| SpecError::Invalid {
            tool: SendPlan::NAME,
            reason: "no command was made; give at least one".into(),
        })?;
        if is_short {
            shorten_report(&mut last);
        }
        Ok(PlanReply { commands, tool_calls: self.tool_calls, executed_steps, stopped, last })
    }

    /// Makes one command of a plan. What keeps the first from being made refuses the plan; later, and where the episode ends, it is why
    /// the plan goes no further.
    fn make_planned<'a>(
        &mut self,
        caller: CallerRecord,
        call: ActCall,
        progress: &'a mut PlanProgress,
    ) -> Result<Result<&'a CommandReply, String>, EpisodeError> {
        let made = self.make(caller, &Called::from(ToolCall::Act(call)));
        let reply = match made.and_then(|answer| answer.reply(&Formats::default())) {
            Ok(ToolReply::Act(reply)) => reply,
            Ok(other) => return Ok(Err(format!("{other:?} is no reply to a command"))),
            Err(error) if progress.last.is_none() => return Err(error),
            Err(error) => return Ok(Err(error.to_string())),
        };
        progress.commands += 1;
        progress.executed_steps += reply.executed_steps;
        let stop = reply.stop_reason;
        let reply = progress.last.insert(reply);
        Ok(match stop {
            StopReason::StepsDone | StopReason::PartnerDone => Ok(reply),
            StopReason::TaskComplete => Err("the task is complete".into()),
            StopReason::StepBudgetExhausted => Err("the episode's steps are used up".into()),
        })
    }
}

impl PlanProgress {
    /// Control steps so far.
    fn executed_steps(&self) -> u32 {
        self.executed_steps
    }
}

/// What of `expected` is not so after a command; `None` if all is.
fn unexpected(expected: &Expectation, reply: &CommandReply) -> Option<String> {
    let Expectation { arrived, blocked, force_above_n, force_below_n, phase_reached, base_stepping } =
        expected;
    let hands = || reply.robots.iter().flat_map(hands_of);
    let under_way =
        hands().find(|(_, hand)| !matches!(hand.state, Some(HandState::Arrived | HandState::Idle)));
    let stopped =
        hands().find(|(_, hand)| matches!(hand.state, Some(HandState::Blocked | HandState::OutOfReach)));
    let steps = reply.robots.iter().find(|robot| {
        robot.base.and_then(|base| base.state).is_some_and(|state| state != BaseState::Standing)
    });
    let force_n = |hand: &HandReport| {
        hand.force_n.map_or(0.0, |force_n| force_n.iter().map(|part| part * part).sum::<f64>().sqrt())
    };
    let most_n = hands().map(|(_, hand)| force_n(hand)).fold(0.0, f64::max);
    let differs = |name: &str, wanted: &Option<bool>, is: bool, who: Option<String>| {
        let wanted = wanted.filter(|wanted| *wanted != is)?;
        Some(format!(
            "{name} is {is}, not {wanted}{}",
            who.map(|who| format!(" ({who})")).unwrap_or_default()
        ))
    };
    let told = |(name, hand): (String, &HandReport)| {
        format!("{name} is {:.3} m off", hand.position_error_m.unwrap_or_default())
    };
    differs("arrived", arrived, under_way.is_none(), under_way.map(told))
        .or_else(|| differs("blocked", blocked, stopped.is_some(), stopped.map(told)))
        .or_else(|| {
            differs("base_stepping", base_stepping, steps.is_some(), steps.map(|robot| robot.robot.clone()))
        })
        .or_else(|| {
            force_above_n
                .filter(|least_n| most_n <= *least_n)
                .map(|least_n| format!("hands feel {most_n:.1} N at most, not above {least_n}"))
        })
        .or_else(|| {
            force_below_n
                .filter(|limit_n| most_n > *limit_n)
                .map(|limit_n| format!("a hand feels {most_n:.1} N, above {limit_n}"))
        })
        .or_else(|| {
            let phase = phase_reached.as_ref()?;
            let is_reached =
                reply.phases.iter().any(|reached| reached.number == *phase || reached.id == *phase);
            (!is_reached)
                .then(|| format!("{phase} has not been reached; get_status with explain says what it lacks"))
        })
}

/// Both hands of a robot, each with what it is called.
fn hands_of(report: &RobotReport) -> [(String, &HandReport); 2] {
    [
        (format!("{}'s left wrist", report.robot), &report.left),
        (format!("{}'s right wrist", report.robot), &report.right),
    ]
}
