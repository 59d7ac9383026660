//! How calls reach an episode: what is refused before it counts, what is counted and recorded, and what the policy's clock does.

use tandem_sim::Step;
use tandem_tools_spec::{
    Assistance, Call, EndReason, ExtraInformation, Formats, GetRobotState, Look, ManageReply, Observation,
    Observe, TalkCall, ToolCall, ToolReply,
};

use super::Session;
use super::answer::Answer;
use super::told::shorten;
use crate::EpisodeError;
use crate::commands::{Called, Command, OperatorCall, OperatorCommand, RobotOrder};
use crate::observation::TeamObservation;
use crate::output::OutputError;
use crate::recording::{CallOutcome, CallerRecord, ToolCallRecord};
use crate::reports::episode::SaidWords;

/// What a call comes to.
#[derive(Clone, Debug)]
pub struct CallReply {
    pub reply: ToolReply,
    /// What was seen after a command that asked for it.
    pub observation: Option<Observation>,
}

impl Session {
    /// Answers a tool call of the policy that directs all robots. An error changes nothing but the count of calls. The call that ends
    /// the episode, and no later one, is counted and recorded, and closes the files.
    pub fn call(&mut self, call: ToolCall) -> Result<ToolReply, EpisodeError> {
        match &call {
            ToolCall::Plan(plan) => self.plan(CallerRecord::Policy, plan).map(ToolReply::Plan),
            _ => self.make(CallerRecord::Policy, &call.into()),
        }
    }

    /// As [`Session::call`], with all that may go with a call, by the operator of a robot or by the policy of all. A call that was
    /// made for another step, or whose look afterwards could not be had, is refused before it counts.
    pub fn ask(&mut self, operator: Option<&str>, mut call: Call) -> Result<CallReply, EpisodeError> {
        self.admit(operator, &call)?;
        call.expected_step = None;
        let then = call.then.take();
        let caller = operator.map_or(CallerRecord::Policy, CallerRecord::Operator);
        let reply = match &call.tool {
            ToolCall::Plan(plan) => {
                let mut reply = ToolReply::Plan(self.plan(caller, plan)?);
                if call.short {
                    shorten(&mut reply);
                }
                reply
            }
            _ => self.make(caller, &Called::One(call))?,
        };
        Ok(CallReply { reply, observation: self.look_after(caller, then)? })
    }

    /// As [`Session::call`] of `observe`, for who asks a policy in this process: with views as they were drawn, and nothing
    /// withheld. Of what the benchmark's own policies are not shown, the policy itself is `shown` this.
    pub fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, EpisodeError> {
        let look = Look { observe: observe.clone(), formats: Formats::default() };
        let underway = self.ended.is_none();
        let seen = self.look_once(CallerRecord::InProcess(shown), &look);
        seen.iter().filter(|_| underway).for_each(|seen| self.shown.count_each(shown, seen));
        self.let_think();
        seen
    }

    /// As [`Session::call`] of `observe`, for a policy in this process: what it is told, with views as they were drawn.
    pub fn observe_as_told(&mut self, look: &Look) -> Result<TeamObservation, EpisodeError> {
        let seen = self.look_as_told(CallerRecord::Policy, look);
        self.let_think();
        seen
    }

    /// As [`Session::call`] of `get_robot_state` for each robot, for a policy in this process that needs no text: what it is told of the
    /// step that is returned is the assistance's.
    pub fn read_states(&mut self) -> Result<(Assistance, &Step), EpisodeError> {
        let robots: Vec<String> = self.motions.iter().map(|motion| motion.robot.name.clone()).collect();
        for robot in robots {
            match self.files {
                Some(_) => {
                    let called = Called::One(ToolCall::from(GetRobotState { robot }).into());
                    self.make(CallerRecord::Policy, &called)?;
                }
                None => self.count_state_read(&robot),
            }
        }
        Ok((self.spec().assistance, &self.present))
    }

    /// A call of `get_robot_state` whose answer nobody needs as such.
    fn count_state_read(&mut self, robot: &str) {
        let counts = self.ended.is_none();
        self.arrived();
        if counts && self.spec().assistance == Assistance::Full {
            self.shown.count_whole_state(robot);
        }
        if self.ended.is_some() {
            self.settle();
        }
        self.let_think();
    }

    /// As [`Session::call`] of an acting tool, for who reads numbers of what comes of it: there is no reply, so that none is made unless
    /// it is recorded or shown.
    pub fn act_unreported(&mut self, call: &ToolCall) -> Result<(), EpisodeError> {
        let act = match call {
            ToolCall::Act(act) if self.files.is_none() && !self.shows_calls() => act,
            _ => return self.call(call.clone()).map(drop),
        };
        self.arrived();
        let acted = self.expect_underway().and_then(|()| self.carry_out_unreported(act));
        if self.ended.is_some() {
            self.settle();
        }
        self.let_think();
        acted
    }

    /// As [`Session::call`], for who carries out what a policy in this process decided: nothing is withheld from the reply, which the
    /// policy itself is not shown.
    pub fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, EpisodeError> {
        let called = Called::One(call.into());
        let underway = self.arrived();
        let answer = self.answer(&called);
        let assistance = self.spec().assistance;
        let told = answer.as_ref().map(|answer| answer.told(assistance));
        self.came_out(underway, CallerRecord::InProcess(&[]), &called, CallOutcome::of(&told));
        let reply = answer.and_then(|answer| answer.reply(&called));
        self.let_think();
        reply
    }

    /// Reads an operator's command, which [`Session::together`] executes when those of others are there, too. A refusal is counted and
    /// recorded as that of any call.
    pub fn read_command(&mut self, call: OperatorCall) -> Result<OperatorCommand, EpisodeError> {
        self.admit(Some(call.robot()), call.call())?;
        let order = self.expect_underway().and_then(|()| call.order(&self.rules, &self.motions));
        let refusal = match order {
            Ok(order) => return Ok(OperatorCommand { call, order }),
            Err(refusal) => refusal,
        };
        let operator = call.robot().to_owned();
        self.refuse(CallerRecord::Operator(&operator), &Called::Together(vec![call]), &refusal);
        Err(refusal)
    }

    /// Counts and records a call that has been refused.
    pub(super) fn refuse(&mut self, caller: CallerRecord, called: &Called, refusal: &EpisodeError) {
        let underway = self.arrived();
        self.came_out(underway, caller, called, CallOutcome::refused(refusal));
        self.let_think();
    }

    /// Executes the commands of several operators side by side, and looks for each what it wants to see then.
    pub fn together(&mut self, commands: Vec<OperatorCommand>) -> Result<Vec<CallReply>, EpisodeError> {
        let (mut calls, orders): (Vec<OperatorCall>, Vec<RobotOrder>) =
            commands.into_iter().map(|command| (command.call, command.order)).unzip();
        let after = |call: &mut OperatorCall| (call.robot().to_owned(), call.take_look(), call.call().short);
        let looks: Vec<(String, Option<Look>, bool)> = calls.iter_mut().map(after).collect();
        let called = Called::Together(calls);
        let underway = self.arrived();
        let mut answer = self.expect_underway().and_then(|()| self.act(&Command::together(orders)));
        for answer in answer.iter_mut() {
            answer.withhold(self.spec().assistance);
            self.count(answer, &called, CallerRecord::Policy);
        }
        self.came_out(underway, CallerRecord::Policy, &called, CallOutcome::of(&answer));
        self.let_think();
        let reply = answer?.reply(&called)?;
        let replies = looks.into_iter().map(|(robot, look, short)| {
            let mut reply = reply.clone();
            if short {
                shorten(&mut reply);
            }
            Ok(CallReply { reply, observation: self.look_after(CallerRecord::Operator(&robot), look)? })
        });
        replies.collect()
    }

    /// Makes a call with nothing around it. The reply tells what the policy may be told, whoever calls.
    pub(super) fn make(&mut self, caller: CallerRecord, called: &Called) -> Result<ToolReply, EpisodeError> {
        let counts = self.ended.is_none();
        let is_short = matches!(called, Called::One(Call { short: true, .. }));
        let underway = self.arrived();
        let mut answer = self.answer(called);
        for answer in answer.iter_mut() {
            answer.withhold(self.spec().assistance);
            if counts {
                let mut shown = answer.clone();
                if let (true, Answer::Reply(reply)) = (is_short, &mut shown) {
                    shorten(reply);
                }
                self.count(&shown, called, caller);
            }
        }
        self.came_out(underway, caller, called, CallOutcome::of(&answer));
        if let Ok(Answer::Reply(reply)) = &mut answer
            && let ToolReply::Manage(ManageReply::Finish(reply)) = &mut **reply
        {
            // Closing the files may have failed, which the reply has to say.
            *reply = self.result().disclosed(self.spec().disclosure);
        }
        let mut reply = answer.and_then(|answer| answer.reply(called));
        if is_short {
            // The recording has all of it.
            reply.iter_mut().for_each(shorten);
        }
        self.let_think();
        reply
    }

    /// Counts what an answer shows from which nothing is to be withheld any more.
    fn count(&mut self, answer: &Answer, called: &Called, caller: CallerRecord) {
        let formats = match called {
            Called::One(call) => call.formats,
            Called::Together(_) => Formats::default(),
        };
        match (caller, answer) {
            (CallerRecord::Policy | CallerRecord::Operator(_), answer) => {
                self.shown.count_answer(answer, &formats, self.origin.spec.protocol);
            }
            (CallerRecord::InProcess(shown), Answer::Observation(seen)) => self.shown.count_each(shown, seen),
            (CallerRecord::InProcess(_), Answer::Reply(_)) => {}
        }
    }

    /// Whether the episode stands where a call expects it, and what it wants to see afterwards can be seen.
    fn check_around(&self, call: &Call) -> Result<(), EpisodeError> {
        let now = self.env_steps();
        if let Some(expected) = call.expected_step.filter(|expected| *expected != now) {
            return Err(EpisodeError::OtherStep { expected, now });
        }
        call.then.as_ref().map_or(Ok(()), |look| self.check_look(look))
    }

    /// As [`Session::check_around`]; a refusal is told.
    fn admit(&mut self, operator: Option<&str>, call: &Call) -> Result<(), EpisodeError> {
        let refused = self.check_around(call).err();
        refused.map_or(Ok(()), |refusal| {
            let arguments = serde_json::to_string(call).map_err(OutputError::from)?;
            self.refused_before(operator, call.name(), &arguments, &refusal.to_string());
            Err(refusal)
        })
    }

    /// Looks after a command, if that was asked for: a call of its own.
    fn look_after(
        &mut self,
        caller: CallerRecord,
        look: Option<Look>,
    ) -> Result<Option<Observation>, EpisodeError> {
        let Some(look) = look else { return Ok(None) };
        let observation = self.look_as_told(caller, &look).and_then(|seen| Ok(seen.reply(&look.formats)?));
        self.let_think();
        observation.map(Some)
    }

    /// What a look shows, as the policy is told it, which is counted.
    fn look_as_told(&mut self, caller: CallerRecord, look: &Look) -> Result<TeamObservation, EpisodeError> {
        let underway = self.ended.is_none();
        let seen = self.look_once(caller, look).map(|seen| seen.told(self.spec().assistance));
        seen.iter().filter(|_| underway).for_each(|seen| self.shown.count_seen(seen, &look.formats));
        seen
    }

    /// What a look shows, with nothing withheld; it is recorded as a policy is told it.
    fn look_once(&mut self, caller: CallerRecord, look: &Look) -> Result<TeamObservation, EpisodeError> {
        let underway = self.arrived();
        let call = Call::from(look.clone());
        let valid = call.validate().map_err(EpisodeError::from);
        let seen = valid.and_then(|()| self.seen(&look.observe, &look.formats));
        let told = seen.as_ref().map(|seen| seen.told(self.spec().assistance));
        self.came_out(underway, caller, &Called::One(call), CallOutcome::of(&told));
        seen
    }

    /// A call has arrived. Returns whether it is one of the episode's.
    fn arrived(&mut self) -> bool {
        self.clock.pause();
        if self.ended.is_none() && self.clock.exhausted() {
            self.ended = Some(EndReason::WallClockExhausted);
        }
        let underway = self.result.is_none();
        self.tool_calls += u32::from(underway);
        if underway && !self.planning {
            self.count_request();
        }
        underway
    }

    /// The policy has asked for something: for a call, or for a plan of several.
    pub(super) fn count_request(&mut self) {
        self.requests = self.requests.map(|requests| requests + 1);
    }

    /// A call has come out: records it, and closes the files if it has ended the episode.
    fn came_out(&mut self, underway: bool, caller: CallerRecord, called: &Called, outcome: CallOutcome) {
        if underway && (self.files.is_some() || self.shows_calls()) {
            let time_s = self.present.time_s;
            if let Some(files) = &mut self.files {
                files.count_call(called.name(), outcome.is_ok());
                if let (Called::One(call), Some(robot), true) = (called, caller.operator(), outcome.is_ok())
                    && let ToolCall::Talk(TalkCall::Say(said)) = &call.tool
                {
                    let words = SaidWords { time_s, robot: robot.into(), text: said.text.clone() };
                    files.keep_words(words);
                }
            }
            self.tell(ToolCallRecord::new(self.now(), caller, called, outcome));
        }
        // A plan that has ended the episode is told behind its last command.
        if self.ended.is_some() && !self.planning {
            self.settle();
        }
    }

    /// The policy's clock goes on, unless the episode has ended.
    pub(super) fn let_think(&mut self) {
        if self.ended.is_none() {
            self.clock.resume();
        }
    }
}
