//! Calls of the operator of one robot of an episode. A call waits until the robot's reply is ready.

use std::sync::{Arc, MutexGuard};

use tandem_episodes::OperatorCall;
use tandem_tools_spec::{
    Call, EndReason, Finish, GetStatus, Heard, ManageCall, ManageReply, Partner, PartnerDid, TalkCall,
    ToolCall, ToolReply,
};
use tokio::sync::oneshot;

use super::{
    Team,
    clock::to_ms,
    round::{Operator, Pending, Round},
    setpoint::TICK,
};
use crate::hosting::{Answer, EpisodeThread, HostingError, durable::Keyed};

/// The operator of one robot of an episode.
#[derive(Debug, Clone)]
pub struct OperatorHandle {
    pub(super) team: Arc<Team>,
    pub episode: Arc<EpisodeThread>,
    /// Index of the robot.
    pub(super) seat: usize,
}

impl OperatorHandle {
    /// Returns the operator of `robot`.
    pub fn new(
        team: &Arc<Team>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
    ) -> Result<OperatorHandle, HostingError> {
        Ok(OperatorHandle { team: team.clone(), episode: episode.clone(), seat: team.seat(robot)? })
    }

    /// Returns the name of the robot.
    pub fn robot(&self) -> &str {
        &self.team.seats[self.seat].robot
    }

    pub(super) fn round(&self) -> MutexGuard<'_, Round> {
        self.team.round()
    }

    /// Calls `work` with the operator's state in the round.
    pub(super) fn own<T>(&self, work: impl FnOnce(&mut Operator) -> T) -> T {
        work(&mut self.round().operators[self.seat])
    }

    /// Answers a call.
    pub async fn call(&self, call: Call, keyed: Option<Keyed>) -> Result<Answer, HostingError> {
        self.team.check_robots(&call)?;
        let call = OperatorCall::new(self.robot(), call)?;
        self.own(Operator::arrive);
        if let ToolCall::Act(_) | ToolCall::Plan(_) = &call.call().tool {
            self.check_clock()?;
        }
        match &call.call().tool {
            ToolCall::Act(_) => self.act(call, keyed).await,
            ToolCall::Talk(TalkCall::Say(say)) => {
                let words = Heard { from: self.robot().into(), text: say.text.clone(), step: 0, number: 0 };
                self.say(call, words, keyed).await
            }
            ToolCall::Plan(plan) => {
                let plan = plan.clone();
                self.plan(call, plan, keyed).await
            }
            ToolCall::Manage(ManageCall::Finish(_)) => self.finish(keyed).await,
            ToolCall::Look(_) | ToolCall::Manage(ManageCall::GetStatus(_)) => {
                let _place = self.team.take_place(self.robot())?;
                self.ask(call.into_call(), keyed, OperatorHandle::looked).await
            }
        }
    }

    /// Passes a call to the episode. `then` converts the answer for the operator.
    async fn ask(
        &self,
        call: Call,
        keyed: Option<Keyed>,
        then: impl FnOnce(&OperatorHandle, Answer) -> Answer + Send + 'static,
    ) -> Result<Answer, HostingError> {
        let own = self.clone();
        let then = move |answer| own.own_answer(then(&own, answer));
        self.episode.ask(Some(self.robot()), call, keyed, then).await
    }

    /// Records that the operator has observed the current state. Adds the actions of the others to a status.
    fn looked(&self, answer: Answer) -> Answer {
        let mut round = self.round();
        round.operators[self.seat].has_looked();
        match answer.reply {
            ToolReply::Manage(ManageReply::GetStatus(_)) => {
                Answer { presence: round.presence(self.seat), ..answer }
            }
            _ => answer,
        }
    }

    /// Sends a message to the others.
    async fn say(
        &self,
        call: OperatorCall,
        words: Heard,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        if !self.team.talk {
            return Err(HostingError::NoTalk);
        }
        self.round().check_unheard(self.seat)?;
        let _place = self.team.take_place(self.robot())?;
        self.ask(call.into_call(), keyed, move |own, answer| {
            let mut round = own.round();
            let said = round.operators[own.seat].count_said();
            if own.team.rules.silence.is_none_or(|silence| silence.lets_hear(own.seat, said)) {
                let step = answer.step.unwrap_or_default();
                round.spread(own.seat, &Heard { step, number: said + 1, ..words });
            }
            answer
        })
        .await
    }

    /// Executes a command and returns its answer.
    ///
    /// People and programs that drive in real time command one step each. Beside them, a longer command
    /// continues over as many of their rounds as it has steps. Commands of an expert or a policy always
    /// continue in this way.
    async fn act(&self, call: OperatorCall, keyed: Option<Keyed>) -> Result<Answer, HostingError> {
        if call.call().steps() <= 1 || !self.goes_on() {
            return self.act_once(call, keyed).await;
        }
        let own = self.clone();
        self.finish_all(keyed, async move { own.act_on(call).await }).await
    }

    /// Executes a command that continues after shorter commands of the others have ended.
    pub(super) async fn act_on(&self, mut left: OperatorCall) -> Result<Answer, HostingError> {
        let (mut executed_steps, mut heard, mut partners) = (0, Vec::new(), Vec::new());
        loop {
            let is_cut_off = left.call().steps() > 1 && self.goes_on();
            let part = if is_cut_off { left.clone().unseen() } else { left.clone() };
            let mut answer = self.act_once(part, None).await?.with_partners_before(partners);
            let rest = answer.cut_off_steps().and_then(|steps| Some((steps, left.rest(steps)?)));
            match rest.filter(|_| self.goes_on()) {
                Some((steps, rest)) => {
                    left = rest;
                    executed_steps += steps;
                    heard.append(&mut answer.heard);
                    partners = answer.partners;
                }
                None => return Ok(answer.after(executed_steps, heard)),
            }
        }
    }

    /// Runs `work` to its end even if the caller leaves, and keeps the answer to a call with a key.
    pub(super) async fn finish_all(
        &self,
        keyed: Option<Keyed>,
        work: impl Future<Output = Result<Answer, HostingError>> + Send + 'static,
    ) -> Result<Answer, HostingError> {
        let episode = self.episode.clone();
        let going_on = tokio::spawn(async move {
            let answer = work.await?;
            match keyed {
                Some(keyed) => episode.keep_answer(keyed, answer).await,
                None => Ok(answer),
            }
        });
        going_on.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    fn goes_on(&self) -> bool {
        self.round().goes_on(self.seat)
    }

    /// Records that the operator sends single control steps in real time. Partners' commands continue over
    /// these steps, and the duration of a step is not charged as thinking time.
    pub fn pace(&self) {
        self.own(|own| {
            own.set_pace(TICK);
            own.paced = true;
        });
    }

    /// Adds a command to the next step and returns its answer when the step has been executed.
    async fn act_once(&self, call: OperatorCall, keyed: Option<Keyed>) -> Result<Answer, HostingError> {
        self.round().admit(self.seat)?;
        // A command that cannot be executed is refused before it becomes part of the round.
        let place = self.team.take_place(call.robot())?;
        let command = self.episode.read_command(call).await?;
        drop(place);
        let (reply, answer) = oneshot::channel();
        {
            let mut round = self.round();
            round.admit(self.seat)?;
            round.operators[self.seat].command(Pending { command, keyed, reply });
        }
        self.go_on();
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Marks the operator as finished. The last operator to finish ends the episode. For the others the
    /// answer is the episode's status, and their robots hold still.
    async fn finish(&self, keyed: Option<Keyed>) -> Result<Answer, HostingError> {
        let others_play_on = !self.episode.ended() && self.round().finish(self.seat)?;
        let call: ToolCall = match others_play_on {
            true => GetStatus::default().into(),
            false => Finish {}.into(),
        };
        if others_play_on {
            self.go_on();
        }
        let then = move |own: &OperatorHandle, answer| {
            own.own(Operator::has_looked);
            Answer { others_play_on, ..answer }
        };
        self.ask(call.into(), keyed, then).await
    }

    /// Returns an error once the operator has used up its thinking time. Its robot then holds still, as if
    /// the operator had finished. The episode ends if no other operator plays.
    fn check_clock(&self) -> Result<(), HostingError> {
        let limit = self.team.rules.thinking_limit;
        let Some(limit) = limit.filter(|limit| self.own(|own| own.thought()) >= *limit) else {
            return Ok(());
        };
        let others_play_on = self.round().finish(self.seat)?;
        match others_play_on {
            true => self.go_on(),
            false => self.episode.end(EndReason::WallClockExhausted)?,
        }
        Err(HostingError::OperatorOutOfTime { robot: self.robot().into(), limit_s: limit.as_secs() })
    }

    /// Begins the step if no operator's command is missing; otherwise starts the patience timer. Does nothing
    /// if no operator has commanded.
    pub(super) fn go_on(&self) {
        let mut round = self.round();
        if !round.may_begin() {
            return;
        }
        if round.awaited().is_empty() {
            self.begin(&mut round);
        } else if !round.is_timed() {
            let (own, number) = (self.clone(), round.number);
            let waiting = tokio::spawn(async move {
                tokio::time::sleep(own.team.patience).await;
                let mut round = own.round();
                if round.number == number && round.may_begin() {
                    round.lose_patience();
                    own.begin(&mut round);
                }
            });
            round.time(waiting.abort_handle());
        }
    }

    fn begin(&self, round: &mut Round) {
        let (own, pending) = (self.clone(), round.begin());
        tokio::spawn(async move { own.execute(pending).await });
    }

    /// Executes the step with the pending commands, and sends each operator its answer.
    async fn execute(&self, pending: Vec<(usize, Pending)>) {
        let (mut replies, mut commands, mut asked) = (Vec::new(), Vec::new(), Vec::new());
        for (seat, Pending { command, keyed, reply }) in pending {
            let operator = OperatorHandle { seat, ..self.clone() };
            let used = operator.own(|own| own.used());
            asked.push((operator, command.steps(), command.tool()));
            commands.push((command.with_use(used), keyed));
            replies.push(reply);
        }
        let team = self.team.clone();
        let then = move |answers: Vec<Answer>| {
            let did = team.round().end(answers.first());
            let tools: Vec<(usize, &'static str)> =
                asked.iter().map(|(operator, _, tool)| (operator.seat, *tool)).collect();
            let tell = |((operator, asked_steps, _), answer): (&(OperatorHandle, u32, _), Answer)| {
                let partners = operator.partners(&did, &tools);
                Answer { partners, ..operator.own_answer(answer) }.cut_off_after(*asked_steps)
            };
            asked.iter().zip(answers).map(tell).collect()
        };
        match self.episode.together(commands, then).await {
            Ok(answers) => {
                for (reply, answer) in replies.into_iter().zip(answers) {
                    // The step is recorded even if a caller has stopped waiting.
                    let _ = reply.send(Ok(answer));
                }
            }
            Err(error) => {
                self.round().end(None);
                let error = Arc::new(error);
                for reply in replies {
                    let _ = reply.send(Err(HostingError::Shared(error.clone())));
                }
            }
        }
        self.go_on();
    }

    /// Restricts an answer to the parts that the operator may see, and adds the operator's unread messages.
    fn own_answer(&self, answer: Answer) -> Answer {
        let (heard, thought) = self.own(|own| (own.take_heard(), own.thought()));
        let left_s = self.team.rules.thinking_limit.map(|limit| to_ms(limit.saturating_sub(thought)));
        Answer { heard, ..answer.of_own_robot(self.robot()).with_clock_left(left_s) }
    }

    /// Returns the behaviour of the operator's partners, selected from `did`, which covers all robots.
    fn partners(&self, did: &[PartnerDid], tools: &[(usize, &'static str)]) -> Vec<Partner> {
        let others = self.team.seats.iter().zip(did).enumerate().filter(|(other, _)| *other != self.seat);
        let partner = |(other, (who, did)): (usize, (&super::Seat, &PartnerDid))| {
            let tool = tools.iter().find(|(seat, _)| *seat == other).map(|(_, tool)| (*tool).to_owned());
            Partner { robot: who.robot.clone(), did: *did, tool }
        };
        others.map(partner).collect()
    }
}
