//! Calls to an episode: a [`Request`] has a caller, a call, and an audience for the answer. This module
//! handles refusals that do not count, withholding, recording, counting, and control of the policy's clock.

use tandem_sim::Step;
use tandem_tools_spec::{
    Assistance, Call, EndReason, ExtraInformation, Formats, GetRobotState, Look, ManageReply, Observation,
    Observe, SpecError, TalkCall, Tool as _, ToolCall, ToolReply,
};

use super::Session;
use super::answer::Answer;
use super::journal::KeptRequest;
use super::told::shorten;
use crate::EpisodeError;
use crate::commands::{Called, OperatorCall, OperatorCommand};
use crate::observation::TeamObservation;
use crate::output::OutputError;
use crate::pages::SaidWords;
use crate::recording::{CallMoment, CallOutcome, CallerRecord, ToolCallRecord};

/// A request to an episode.
#[derive(Clone, Debug)]
pub struct Request<'a> {
    pub caller: Caller<'a>,
    pub called: Called,
    pub audience: Audience<'a>,
}

/// The caller of a request.
#[derive(Clone, Copy, Debug)]
pub enum Caller<'a> {
    /// The policy that directs all robots, or several operators together.
    Policy,
    /// The operator of this robot.
    Operator(&'a str),
}

/// The audience of an answer.
#[derive(Clone, Copy, Debug)]
pub enum Audience<'a> {
    /// The caller; it receives the information that the episode's assistance grants.
    Caller,
    /// This process, which receives all information on behalf of a policy. The list is the information shown
    /// to the policy that the benchmark withholds from its policies; results name it.
    Process(&'a [ExtraInformation]),
}

/// The answer to a request in the form for its audience; views are not encoded yet.
#[derive(Clone)]
pub struct Outcome {
    answer: Answer,
    formats: Formats,
    /// For each caller of the request: true for a short reply, and the observation requested after the
    /// command.
    parts: Vec<(bool, Option<SeenAfter>)>,
}

/// An observation after a command, and the formats of its images.
#[derive(Clone)]
struct SeenAfter {
    seen: TeamObservation,
    formats: Formats,
}

/// Reply to a call.
#[derive(Clone, Debug)]
pub struct CallReply {
    pub reply: ToolReply,
    /// Observation after a command that requested one.
    pub observation: Option<Observation>,
}

impl<'a> Request<'a> {
    /// Returns a call by the policy that directs all robots.
    pub fn of_policy(called: impl Into<Called>) -> Request<'a> {
        Request { caller: Caller::Policy, called: called.into(), audience: Audience::Caller }
    }

    /// Returns the request in the journal's form.
    fn asked(&self) -> Result<KeptRequest, serde_json::Error> {
        let shown = match self.audience {
            Audience::Caller => None,
            Audience::Process(shown) => Some(shown),
        };
        KeptRequest::call(self.caller.operator(), shown, &self.called)
    }
}

impl Outcome {
    /// Returns a reply for each caller of the request, with views encoded in the requested formats.
    pub fn replies(self) -> Result<Vec<CallReply>, EpisodeError> {
        let Outcome { answer, formats, parts } = self;
        let reply = answer.reply(&formats)?;
        let told = parts.into_iter().map(|(is_short, after)| {
            let mut reply = reply.clone();
            if is_short {
                // The recording contains the full reply.
                shorten(&mut reply);
            }
            let observation = after.map(|SeenAfter { seen, formats }| seen.reply(&formats)).transpose()?;
            Ok(CallReply { reply, observation })
        });
        told.collect()
    }

    /// Returns the reply to a request with one caller.
    pub fn reply(self) -> Result<CallReply, EpisodeError> {
        self.replies()?
            .pop()
            .ok_or_else(|| unanswered(Called::TOGETHER, "it has no command; give one at least"))
    }

    /// Returns the requested observation, with views not encoded.
    pub fn seen(self) -> Result<TeamObservation, EpisodeError> {
        match self.answer {
            Answer::Observation(seen) => Ok(seen),
            Answer::Reply(_) => Err(unanswered(Observe::NAME, "another tool was called")),
        }
    }
}

fn unanswered(tool: &'static str, reason: &str) -> EpisodeError {
    SpecError::Invalid { tool, reason: reason.into() }.into()
}

impl Session {
    /// Performs a request and returns the answer in the form for its audience. A refused call only increases
    /// the count of calls. A request for another step, or with an observation that cannot be made, is refused
    /// before it counts. The call that ends the episode is the last one counted and recorded; it closes the
    /// files.
    ///
    /// # Errors
    ///
    /// Returns the reason why the call is refused or fails.
    pub fn perform(&mut self, request: Request) -> Result<Outcome, EpisodeError> {
        let arrival = self.arrival(|| request.asked());
        let outcome = self.do_what_is_asked(request);
        self.write_down(arrival);
        outcome
    }

    fn do_what_is_asked(&mut self, request: Request) -> Result<Outcome, EpisodeError> {
        let Request { caller, mut called, audience } = request;
        self.admit(caller, &called)?;
        let callers = called.take_surroundings();
        let record = audience.record(caller);
        let answer = match &called {
            Called::One(Call { tool: ToolCall::Plan(plan), .. }) => {
                ToolReply::Plan(self.plan(record, plan)?).into()
            }
            _ => {
                self.planning = called.continues_plans();
                let made = self.make(record, &called);
                self.planning = false;
                if self.ended.is_some() {
                    self.settle();
                }
                made?
            }
        };
        let mut parts = Vec::with_capacity(callers.len());
        for around in callers {
            let caller = around.operator.as_deref().map_or(caller, Caller::Operator);
            parts.push((around.short, self.look_after(audience.record(caller), around.then)?));
        }
        Ok(Outcome { answer, formats: called.formats(), parts })
    }

    /// Performs a tool call by the policy that directs all robots.
    pub fn call(&mut self, call: ToolCall) -> Result<ToolReply, EpisodeError> {
        Ok(self.perform(Request::of_policy(call))?.reply()?.reply)
    }

    /// Performs a call like [`Session::call`], with its options, by the operator of a robot or by the policy
    /// that directs all robots.
    pub fn ask(&mut self, operator: Option<&str>, call: Call) -> Result<CallReply, EpisodeError> {
        let caller = operator.map_or(Caller::Policy, Caller::Operator);
        self.perform(Request { caller, ..Request::of_policy(call) })?.reply()
    }

    /// Observes like [`Session::call`] with `observe`, on behalf of a policy in this process. Views are not
    /// encoded, and no data are withheld. `shown` is the information shown to the policy that the benchmark
    /// withholds from its policies.
    pub fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, EpisodeError> {
        let look = Look { observe: observe.clone(), formats: Formats::default() };
        let audience = Audience::Process(shown);
        let sampled = [ExtraInformation::JointVelocities, ExtraInformation::InertialReadings];
        let call = Call { samples: sampled.iter().any(|what| shown.contains(what)), ..Call::from(look) };
        self.perform(Request { audience, ..Request::of_policy(call) })?.seen()
    }

    /// Observes like [`Session::call`] with `observe`, for a policy in this process. The observation has
    /// the policy's level of information, with views not encoded.
    pub fn observe_as_told(&mut self, look: &Look) -> Result<TeamObservation, EpisodeError> {
        self.perform(Request::of_policy(Call::from(look.clone())))?.seen()
    }

    /// Performs a call like [`Session::call`], on behalf of a policy in this process. Nothing is withheld
    /// from the reply, which is not shown to the policy.
    pub fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, EpisodeError> {
        let audience = Audience::Process(&[]);
        Ok(self.perform(Request { audience, ..Request::of_policy(call) })?.reply()?.reply)
    }

    /// Executes the commands of several operators at the same time, then makes the observation that each
    /// operator requested.
    pub fn together(&mut self, commands: Vec<OperatorCommand>) -> Result<Vec<CallReply>, EpisodeError> {
        let mut calls = Vec::with_capacity(commands.len());
        for OperatorCommand { call, used, .. } in commands {
            if let Some(used) = used {
                self.operators.insert(used.robot.clone(), used);
            }
            calls.push(call);
        }
        self.perform(Request::of_policy(Called::Together(calls)))?.replies()
    }

    /// Reads an operator's command, to be executed by [`Session::together`] once the other operators'
    /// commands have been read. A refusal is counted and recorded like that of any call.
    pub fn read_command(&mut self, call: OperatorCall) -> Result<OperatorCommand, EpisodeError> {
        let arrival = self.arrival(|| KeptRequest::command(&call));
        let read = self.read_or_refuse(call);
        if read.is_err() {
            self.write_down(arrival);
        }
        read
    }

    fn read_or_refuse(&mut self, call: OperatorCall) -> Result<OperatorCommand, EpisodeError> {
        let operator = call.robot().to_owned();
        let caller = Caller::Operator(&operator);
        let called = Called::Together(vec![call.clone()]);
        self.admit(caller, &called)?;
        let read = self.allow(&called).and_then(|_| self.expect_underway());
        match read.and_then(|()| call.order(&self.rules, &self.motions)) {
            Ok(order) => Ok(OperatorCommand { call: call.at_any_step(), steps: order.steps, used: None }),
            Err(refusal) => {
                self.refuse(CallerRecord::Operator(&operator), &called, &refusal);
                Err(refusal)
            }
        }
    }

    /// Performs `get_robot_state` for each robot like [`Session::call`], for a policy in this process
    /// that needs no text. The assistance decides which parts of the returned step the policy may use.
    pub fn read_states(&mut self) -> Result<(Assistance, &Step), EpisodeError> {
        let robots: Vec<String> = self.motions.iter().map(|motion| motion.robot.name.clone()).collect();
        for robot in robots {
            match self.files {
                Some(_) => {
                    let called = Called::One(ToolCall::from(GetRobotState::of(&robot)).into());
                    self.make(CallerRecord::Policy, &called)?;
                }
                None => self.count_state_read(&robot),
            }
        }
        Ok((self.spec().assistance, &self.present))
    }

    /// Counts a call of `get_robot_state` without making its reply.
    fn count_state_read(&mut self, robot: &str) {
        let counts = self.ended.is_none();
        self.arrived(CallerRecord::Policy, true);
        if counts && self.spec().assistance == Assistance::Full {
            self.shown.count_whole_state(robot);
        }
        if self.ended.is_some() {
            self.settle();
        }
        self.let_think();
    }

    /// Performs an acting call like [`Session::call`], for callers that read its effect as numbers. No
    /// reply is made unless it is recorded or shown.
    pub fn act_unreported(&mut self, call: &ToolCall) -> Result<(), EpisodeError> {
        let act = match call {
            ToolCall::Act(act) if self.files.is_none() && !self.shows_calls() => act,
            _ => return self.call(call.clone()).map(drop),
        };
        self.arrived(CallerRecord::Policy, false);
        let allowed = self.check_told(call).and_then(|()| self.expect_underway());
        let acted = allowed.and_then(|()| self.carry_out_unreported(act));
        if self.ended.is_some() {
            self.settle();
        }
        self.let_think();
        acted
    }

    /// Counts and records a refused call.
    pub(super) fn refuse(&mut self, caller: CallerRecord, called: &Called, refusal: &EpisodeError) {
        let underway = self.arrived(caller, called.is_look());
        self.came_out(underway, caller, called, CallOutcome::refused(refusal));
        self.let_think();
    }

    /// Makes a single call, without its options.
    pub(super) fn make(&mut self, caller: CallerRecord, called: &Called) -> Result<Answer, EpisodeError> {
        let counts = self.ended.is_none();
        let underway = self.arrived(caller, called.is_look());
        let whole = self.allow(called).and_then(|allowed| self.answer(caller.operator(), allowed));
        let assistance = self.spec().assistance;
        let mut told = whole.as_ref().map(|answer| answer.told(assistance));
        match &told {
            Ok(told) if counts => self.count(told, called, caller),
            Err(refusal) if counts => self.shown.count_refusal(refusal, called),
            Ok(_) | Err(_) => {}
        }
        self.came_out(underway, caller, called, CallOutcome::of(&told));
        if let Ok(Answer::Reply(reply)) = &mut told
            && let ToolReply::Manage(ManageReply::Finish(reply)) = &mut **reply
        {
            // The reply must include a failure to close the files.
            *reply = self.result().disclosed(self.spec().disclosure);
        }
        self.let_think();
        let told = told.ok();
        match (caller, told) {
            (CallerRecord::Policy | CallerRecord::Operator(_), Some(told)) => Ok(told),
            (CallerRecord::Policy | CallerRecord::Operator(_), None) | (CallerRecord::InProcess(_), _) => {
                whole
            }
        }
    }

    /// Counts the information in an answer from which withheld data have been removed.
    fn count(&mut self, answer: &Answer, called: &Called, caller: CallerRecord) {
        match (caller, answer) {
            (CallerRecord::Policy | CallerRecord::Operator(_), answer) => {
                self.shown.count_answer(answer, &called.formats(), self.origin.spec.protocol);
            }
            (CallerRecord::InProcess(shown), Answer::Observation(seen)) => self.shown.count_each(shown, seen),
            (CallerRecord::InProcess(_), Answer::Reply(_)) => {}
        }
    }

    /// Checks that the episode is at the call's expected step, and that the observation requested
    /// afterwards is possible.
    fn check_around(&self, call: &Call) -> Result<(), EpisodeError> {
        let now = self.env_steps();
        if let Some(expected) = call.expected_step.filter(|expected| *expected != now) {
            return Err(EpisodeError::OtherStep { expected, now });
        }
        call.then.as_ref().map_or(Ok(()), |look| self.check_look(look))
    }

    /// Checks every call like [`Session::check_around`]; a refusal is recorded.
    fn admit(&mut self, caller: Caller, called: &Called) -> Result<(), EpisodeError> {
        for call in called.calls() {
            if let Err(refusal) = self.check_around(call) {
                let arguments = serde_json::to_string(call).map_err(OutputError::from)?;
                let problem = refusal.to_string();
                self.tell_beside(caller.operator(), call.name(), &arguments, Err(&problem));
                return Err(refusal);
            }
        }
        Ok(())
    }

    /// Makes the observation requested after a command, which counts as a separate call.
    fn look_after(
        &mut self,
        caller: CallerRecord,
        look: Option<Look>,
    ) -> Result<Option<SeenAfter>, EpisodeError> {
        let Some(look) = look else { return Ok(None) };
        let formats = look.formats;
        match self.make(caller, &Called::One(Call::from(look)))? {
            Answer::Observation(seen) => Ok(Some(SeenAfter { seen, formats })),
            Answer::Reply(_) => Err(unanswered(Observe::NAME, "another tool was called")),
        }
    }

    /// Registers a call before it is made. The clock pauses during the call, except for a policy's own
    /// observation; otherwise repeated observations would give free thinking time. Returns true if the call
    /// belongs to the episode.
    fn arrived(&mut self, caller: CallerRecord, is_look: bool) -> bool {
        self.clock.pause();
        if self.ended.is_none() && self.clock.exhausted() {
            self.ended = Some(EndReason::WallClockExhausted);
        }
        match caller {
            CallerRecord::Policy | CallerRecord::Operator(_) if is_look => self.let_think(),
            CallerRecord::Policy | CallerRecord::Operator(_) | CallerRecord::InProcess(_) => {}
        }
        let underway = self.result.is_none();
        self.tool_calls += u32::from(underway);
        if underway && !self.planning {
            self.count_request();
        }
        underway
    }

    /// Counts a request of the policy: a call, or a plan of several calls.
    pub(super) fn count_request(&mut self) {
        self.requests = self.requests.map(|requests| requests + 1);
    }

    /// Records the outcome of a call, and closes the files if the call has ended the episode.
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
            // A replay reads the clock at the call's arrival, not at its reply.
            let moment = CallMoment { thought: self.clock.spent(), ..self.now() };
            self.tell(ToolCallRecord::new(moment, caller, called, outcome));
        }
        // A plan that has ended the episode is recorded after its last command.
        if self.ended.is_some() && !self.planning {
            self.settle();
        }
    }

    /// Resumes the policy's clock unless the episode has ended.
    pub(super) fn let_think(&mut self) {
        if self.ended.is_none() {
            self.clock.resume();
        }
    }
}

impl<'a> Caller<'a> {
    fn operator(self) -> Option<&'a str> {
        match self {
            Caller::Policy => None,
            Caller::Operator(robot) => Some(robot),
        }
    }
}

impl<'a> Audience<'a> {
    /// Returns the caller in the recording's form.
    fn record(self, caller: Caller<'a>) -> CallerRecord<'a> {
        match (self, caller) {
            (Audience::Process(shown), _) => CallerRecord::InProcess(shown),
            (Audience::Caller, Caller::Policy) => CallerRecord::Policy,
            (Audience::Caller, Caller::Operator(robot)) => CallerRecord::Operator(robot),
        }
    }
}
