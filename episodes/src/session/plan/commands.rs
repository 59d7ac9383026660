//! `send_plan`: commands in sequence. Each runs until its steps are done, or until its expectation holds.

use tandem_sim::Side;
use tandem_tools_spec::{
    ActCall, CommandReply, PlanStep, PlannedCall, PoseFrame, SendPlan, SpecError, Tool as _,
};

use super::PlanAdvance;
use super::expectation::{PartnerNews, PlanMoment, unexpected};
use super::pieces::Pieces;
use super::walkers::Walkers;
use crate::EpisodeError;
use crate::commands::Command;
use crate::scoring::Phase;
use crate::session::Session;

/// The commands of a plan, with its progress.
#[derive(Debug)]
pub struct CommandList {
    steps: Vec<PlanStep>,
    index: usize,
    begun: usize,
    current: Option<CurrentCommand>,
    /// Robot of the plan's operator; `None` for the policy of all robots.
    operator: Option<String>,
    until_heard: bool,
}

/// The current command.
#[derive(Debug)]
enum CurrentCommand {
    Whole,
    Until(Pieces),
    Walk(Walkers),
}

impl Session {
    /// Reads a plan.
    ///
    /// # Errors
    ///
    /// If a command cannot be executed. The plan is then refused as a whole.
    pub(super) fn command_list(
        &self,
        plan: &SendPlan,
        operator: Option<&str>,
    ) -> Result<CommandList, EpisodeError> {
        let steps = plan.calls()?;
        for step in &steps {
            let refused = |reason: String| SpecError::Invalid {
                tool: SendPlan::NAME,
                reason: format!("{}: {reason}", step.place),
            };
            match &step.call {
                PlannedCall::Act(call) if step.until => drop(Pieces::new(call, self)?),
                PlannedCall::Act(call) => {
                    let read = Command::read(call, &self.rules, &self.motions);
                    read.map_err(|error| match error {
                        EpisodeError::TooManySteps { .. } => {
                            refused(format!("{error}; with `until` up to {}", SendPlan::MAX_UNTIL_STEPS))
                                .into()
                        }
                        error => error,
                    })?;
                }
                PlannedCall::WalkTo(walk) => drop(self.walkers(walk, operator)?),
            }
            self.check_phase(step).map_err(refused)?;
            self.check_partners(step, operator).map_err(refused)?;
        }
        if plan.until_heard && operator.is_none() {
            let reason = "`until_heard` is for operators, each of whom has a robot".into();
            return Err(SpecError::Invalid { tool: SendPlan::NAME, reason }.into());
        }
        let operator = operator.map(str::to_owned);
        Ok(CommandList { steps, index: 0, begun: 0, current: None, operator, until_heard: plan.until_heard })
    }

    /// Checks that only an operator's plan has conditions on other operators, and that each names another
    /// operator.
    fn check_partners(&self, step: &PlanStep, operator: Option<&str>) -> Result<(), String> {
        let Some(condition) = step.expects.names_partners() else { return Ok(()) };
        let own =
            operator.ok_or_else(|| format!("`{condition}` is for operators, each of whom has a robot"))?;
        let names = self.motions.iter().map(|motion| motion.robot.name.as_str());
        let others: Vec<&str> = names.filter(|name| *name != own).collect();
        let expected = step.expects.with_alternatives();
        match expected.iter().filter_map(|one| one.heard_from.as_deref()).find(|from| !others.contains(from))
        {
            Some(from) => Err(format!("heard_from is {from:?}; the others are {}", others.join(", "))),
            None => Ok(()),
        }
    }

    fn check_phase(&self, step: &PlanStep) -> Result<(), String> {
        let phases = self.spec().task.phases.iter().enumerate();
        let numbered: Vec<_> = phases.map(|(number, phase)| (Phase::number(number), &phase.id)).collect();
        let is_known = |name: &&String| numbered.iter().any(|(number, id)| number == *name || id == name);
        let expected = step.expects.with_alternatives();
        match expected.iter().filter_map(|one| one.phase_reached.as_ref()).find(|name| !is_known(name)) {
            Some(name) => {
                let have: Vec<String> =
                    numbered.iter().map(|(number, id)| format!("{number} ({id})")).collect();
                Err(format!("there is no phase {name:?}; have: {}", have.join(", ")))
            }
            None => Ok(()),
        }
    }
}

impl CommandList {
    /// Returns the next command after the reply to the previous one.
    pub fn advance(
        &mut self,
        session: &Session,
        last: Option<&CommandReply>,
        news: &PartnerNews,
    ) -> PlanAdvance {
        let words = news.words().filter(|_| self.until_heard);
        loop {
            let Some(step) = self.steps.get(self.index) else { return PlanAdvance::Done(None) };
            let stopped = match (self.current.take(), last) {
                (Some(current), Some(reply)) => match current.go_on(session, step, reply, (news, &words)) {
                    CommandProgress::Make(call, current) => {
                        self.current = Some(current);
                        return PlanAdvance::Make(call);
                    }
                    CommandProgress::Over(stopped) => {
                        stopped.or_else(|| words.clone().filter(|_| self.index + 1 < self.steps.len()))
                    }
                },
                _ => match CurrentCommand::begin(session, step, self.operator.as_deref()) {
                    Ok((call, current)) => {
                        (self.current, self.begun) = (Some(current), self.index + 1);
                        return PlanAdvance::Make(call);
                    }
                    Err(stopped) => Some(stopped),
                },
            };
            if let Some(why) = stopped {
                return PlanAdvance::Done(Some(format!("after {}: {why}", step.place)));
            }
            self.index += 1;
        }
    }

    /// Returns the number of commands that have been begun. The pieces of one command count once.
    pub fn begun(&self) -> u32 {
        self.begun as u32
    }

    /// Returns the place of the last command that has been begun, for example "command 2 of 3".
    pub fn place(&self) -> &str {
        self.last_begun().map_or("", |step| &step.place)
    }

    /// Returns the tool of the last command that has been begun.
    pub fn tool(&self) -> &'static str {
        self.last_begun().map_or(SendPlan::NAME, |step| step.call.name())
    }

    /// Returns true while this wrist has not received its last target in the present command.
    pub fn is_under_way(&self, robot: &str, side: Side) -> bool {
        matches!(&self.current, Some(CurrentCommand::Until(pieces)) if pieces.is_under_way(robot, side))
    }

    /// Returns true if the last command asks for a short reply.
    pub fn is_short(&self) -> bool {
        self.last_begun().is_some_and(|step| step.short)
    }

    /// Returns the frame of the last command's places, if the command walks to places.
    pub fn frame(&self) -> Option<PoseFrame> {
        match &self.last_begun()?.call {
            PlannedCall::WalkTo(walk) => Some(walk.frame),
            PlannedCall::Act(_) => None,
        }
    }

    /// Returns the frame of the last command's places, if the command carries a load to places.
    pub fn carried_in(&self) -> Option<PoseFrame> {
        match &self.last_begun()?.call {
            PlannedCall::WalkTo(walk) => walk.carries().then_some(walk.frame),
            PlannedCall::Act(_) => None,
        }
    }

    fn last_begun(&self) -> Option<&PlanStep> {
        self.steps.get(self.begun.checked_sub(1)?)
    }
}

/// Next step of a command after a reply.
enum CommandProgress {
    Make(ActCall, CurrentCommand),
    /// The end of the command; with a reason, the plan stops.
    Over(Option<String>),
}

impl CurrentCommand {
    fn begin(
        session: &Session,
        step: &PlanStep,
        operator: Option<&str>,
    ) -> Result<(ActCall, CurrentCommand), String> {
        match &step.call {
            PlannedCall::Act(call) if !step.until => Ok((call.clone(), CurrentCommand::Whole)),
            PlannedCall::Act(call) => {
                let mut pieces = Pieces::new(call, session).map_err(|error| error.to_string())?;
                let first = pieces.next_piece().ok_or("it has no steps")?;
                Ok((first, CurrentCommand::Until(pieces)))
            }
            PlannedCall::WalkTo(walk) => {
                let mut walkers = session.walkers(walk, operator).map_err(|error| error.to_string())?;
                match walkers.advance(session, None, &PartnerNews::default()) {
                    PlanAdvance::Make(call) => Ok((call, CurrentCommand::Walk(walkers))),
                    PlanAdvance::Done(why) => Err(why.unwrap_or_else(|| "it has no steps".into())),
                }
            }
        }
    }

    fn go_on(
        self,
        session: &Session,
        step: &PlanStep,
        reply: &CommandReply,
        (news, words): (&PartnerNews, &Option<String>),
    ) -> CommandProgress {
        let missing = |moment: PlanMoment| unexpected(&step.expects, reply, moment);
        let done = PlanMoment { news, is_way_done: true, are_fingers_done: true };
        match self {
            CurrentCommand::Whole => CommandProgress::Over(missing(done)),
            CurrentCommand::Until(mut pieces) => {
                let (is_way_done, are_fingers_done) = (pieces.is_way_done(), pieces.are_fingers_done());
                let missing = missing(PlanMoment { is_way_done, are_fingers_done, ..done });
                match (missing, pieces.next_piece()) {
                    (None, _) => CommandProgress::Over(None),
                    (_, Some(_)) if words.is_some() => CommandProgress::Over(words.clone()),
                    (_, Some(call)) => CommandProgress::Make(call, CurrentCommand::Until(pieces)),
                    (missing, None) => {
                        CommandProgress::Over(missing.map(|why| format!("its steps are done and {why}")))
                    }
                }
            }
            CurrentCommand::Walk(mut walkers) => {
                let next = match words {
                    Some(words) => walkers.end(session, Some(reply), words.clone()),
                    None => walkers.advance(session, Some(reply), news),
                };
                match next {
                    PlanAdvance::Make(call) => CommandProgress::Make(call, CurrentCommand::Walk(walkers)),
                    PlanAdvance::Done(stopped) => CommandProgress::Over(stopped.or_else(|| missing(done))),
                }
            }
        }
    }
}
