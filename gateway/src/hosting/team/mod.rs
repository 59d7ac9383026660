//! The operators of an episode in which each robot has its own.
//!
//! A step is made when every operator has commanded, or when the others' patience with the missing ones
//! ends. Then the robots of the silent operators hold still, and nobody waits for them until they call
//! again. The shortest of the commands ends them all. Each operator has a clock of its own. An operator's
//! call blocks until its robot's reply is there.

mod clock;
mod collection;
mod driving;
mod one_robot;
mod partner;
mod planning;
mod presence;
mod round;
mod rules;

use std::{
    collections::BTreeSet,
    sync::{
        Arc, Mutex, MutexGuard,
        atomic::{AtomicBool, Ordering::Relaxed},
    },
    time::{Duration, Instant},
};

use tandem_episodes::{EpisodeError, OperatorCall};
use tandem_tools_spec::{
    Call, Driving, Finish, GetStatus, Heard, ManageCall, OperatorToken, Partner, PartnerDid, TalkCall,
    ToolCall,
};
use tokio::sync::{Semaphore, SemaphorePermit, oneshot};

use super::{Answer, EpisodeThread, HostingError, durable::Keyed, episode::WAITING_CALLS};
use crate::token::Token;
pub use collection::{CollectedEpisode, Collection, CollectionProgress, CollectionStage};
pub use driving::{Driver, Setpoint, Wish};
use driving::{TICK, Wheel};
pub use partner::PartnerPolicy;
use planning::finish_all;
pub use round::OperatorMemory;
use round::{PartnerKind, Pending, Round};
pub use rules::TeamRules;

/// The operators of one episode.
#[derive(Debug)]
pub struct Team {
    seats: Vec<Seat>,
    patience: Duration,
    talk: bool,
    rules: TeamRules,
    round: Mutex<Round>,
    wheels: Mutex<Wheels>,
}

/// People and partners that drive in this process.
#[derive(Debug, Default)]
struct Wheels {
    /// Driving state by seat; `None` for robots of programs.
    seats: Vec<Option<Wheel>>,
    /// Time at which the pending command was made, by seat.
    under_way: Vec<Option<Instant>>,
    /// Number of drivers up to now.
    drivers: u64,
    /// True while a task turns setpoints into commands.
    turning: bool,
    /// Seats of programs that send one control step after another in real time.
    paced: BTreeSet<usize>,
    /// Expert or policy that drives, by seat.
    partners: Vec<Option<PartnerKind>>,
    /// Partner that drove when the previous server ended, by seat; `None` once it drives again.
    left: Vec<Option<PartnerKind>>,
    /// Number of plans under way.
    plans: u32,
}

/// The operator of one robot.
#[derive(Debug)]
struct Seat {
    robot: String,
    token: Token,
    /// Places for calls that wait for the episode: an equal share, so that operators do not block each
    /// other.
    places: Semaphore,
}

/// Returns the number of calls that may wait for each of `operators`.
fn own_calls(operators: usize) -> usize {
    (WAITING_CALLS / operators.max(1)).max(1)
}

impl Team {
    /// Creates an operator for each of `robots` and returns their tokens. A robot with a seat in
    /// `collection` keeps its token.
    pub fn new<'a>(
        robots: impl Iterator<Item = &'a str>,
        driving: &Driving,
        collection: Option<&Collection>,
        rules: TeamRules,
    ) -> Result<(Team, Vec<OperatorToken>), HostingError> {
        let mut tokens = Vec::new();
        for robot in robots {
            let kept = collection.and_then(|collection| collection.seat(robot));
            let (_, token) = kept.map_or_else(Token::random, Ok)?;
            tokens.push(OperatorToken { robot: robot.into(), token });
        }
        Ok((Team::of(&tokens, driving, rules)?, tokens))
    }

    /// Restores the operators that have these tokens.
    pub fn of(tokens: &[OperatorToken], driving: &Driving, rules: TeamRules) -> Result<Team, HostingError> {
        let mut seats = Vec::new();
        for OperatorToken { robot, token } in tokens {
            let token = Token::parse(token, "an operator")?;
            seats.push(Seat { robot: robot.clone(), token, places: Semaphore::new(own_calls(tokens.len())) });
        }
        let round = Mutex::new(Round::new(seats.iter().map(|seat| seat.robot.clone()).collect()));
        let patience = Duration::from_secs_f64(driving.patience_s());
        let (none, under_way) = (seats.iter().map(|_| None).collect(), vec![None; seats.len()]);
        let (partners, left) = (vec![None; seats.len()], vec![None; seats.len()]);
        let wheels = Mutex::new(Wheels { seats: none, under_way, partners, left, ..Wheels::default() });
        Ok(Team { seats, patience, talk: driving.talk == Some(true), rules, round, wheels })
    }

    /// Returns the robot whose operator has the token `text`. Every token is compared.
    pub fn robot_of(&self, text: &str) -> Option<&str> {
        let mut robot = None;
        for seat in &self.seats {
            if seat.token.matches(text) {
                robot = Some(seat.robot.as_str());
            }
        }
        robot
    }

    /// Takes one of the places that the operator of `robot` has for calls that wait for the episode.
    pub fn take_place(&self, robot: &str) -> Result<SemaphorePermit<'_>, HostingError> {
        let seat = &self.seats[self.seat(robot)?];
        let limit = own_calls(self.seats.len());
        seat.places.try_acquire().map_err(|_| HostingError::TooManyWaiting { limit })
    }

    /// Returns the part of the operators' state that has to be remembered.
    pub fn memory(&self) -> Vec<OperatorMemory> {
        let mut memory = self.round().memory();
        let wheels = self.wheels();
        for (memory, (now, left)) in memory.iter_mut().zip(wheels.partners.iter().zip(&wheels.left)) {
            memory.partner = now.or(*left);
        }
        memory
    }

    /// Restores what was remembered.
    pub fn restore(&self, memory: Vec<OperatorMemory>) {
        self.wheels().left = memory.iter().map(OperatorMemory::left).collect();
        self.round().restore(memory);
    }

    /// Returns true if somebody in this process drives, or waits for others.
    pub fn is_busy(&self) -> bool {
        let wheels = self.wheels();
        let partners = wheels.partners.iter().chain(&wheels.left);
        let drives = partners.flatten().next().is_some() || wheels.seats.iter().any(Option::is_some);
        drives || self.round().may_begin()
    }

    /// Returns true if operators may talk.
    pub fn may_talk(&self) -> bool {
        self.talk
    }

    /// Answers a call of the operator of `robot`.
    pub async fn call(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
        call: Call,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        let seat = self.seat(robot)?;
        self.check_robots(&call)?;
        let call = OperatorCall::new(robot, call)?;
        self.round().arrive(seat);
        if let ToolCall::Act(_) | ToolCall::Plan(_) = &call.call().tool {
            self.check_clock(episode, seat)?;
        }
        match &call.call().tool {
            ToolCall::Act(_) => self.act(episode, seat, call, keyed).await,
            ToolCall::Talk(TalkCall::Say(say)) => {
                let words = Heard { from: robot.into(), text: say.text.clone(), step: 0, number: 0 };
                self.say(episode, seat, call, words, keyed).await
            }
            ToolCall::Plan(plan) => {
                let plan = plan.clone();
                self.plan(episode, seat, (call, plan), keyed).await
            }
            ToolCall::Manage(ManageCall::Finish(_)) => self.finish(episode, seat, keyed).await,
            ToolCall::Look(_) | ToolCall::Manage(ManageCall::GetStatus(_)) => {
                let _place = self.take_place(robot)?;
                self.ask(episode, seat, call.into_call(), keyed, move |team, answer| {
                    team.looked(seat, answer)
                })
                .await
            }
        }
    }

    /// Has the episode answer a call of the operator on `seat`; `then` converts the answer for that
    /// operator.
    async fn ask(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        call: Call,
        keyed: Option<Keyed>,
        then: impl FnOnce(&Team, Answer) -> Answer + Send + 'static,
    ) -> Result<Answer, HostingError> {
        let team = self.clone();
        let told = move |answer: Result<Answer, HostingError>| {
            answer.map(|answer| {
                let answer = then(&team, answer);
                team.for_seat(answer, seat)
            })
        };
        episode.ask(Some(&self.seats[seat].robot), call, keyed, Box::new(told)).await
    }

    /// Sends a message of the operator on `seat` to the others.
    async fn say(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        call: OperatorCall,
        words: Heard,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        if !self.talk {
            return Err(HostingError::NoTalk);
        }
        self.round().check_unheard(seat)?;
        let _place = self.take_place(&words.from)?;
        self.ask(episode, seat, call.into_call(), keyed, move |team, answer| {
            let mut round = team.round();
            let said = round.count_said(seat);
            if team.rules.silence.is_none_or(|silence| silence.lets_hear(seat, said)) {
                let step = answer.step.unwrap_or_default();
                round.spread(seat, &Heard { step, number: said + 1, ..words });
            }
            answer
        })
        .await
    }

    /// Takes a command and answers when it has been executed.
    ///
    /// People and programs that drive in real time command one step each. Beside them, a longer command
    /// continues over as many of their rounds as it has steps. Commands of an expert or a policy always do.
    async fn act(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        call: OperatorCall,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        if call.call().steps() <= 1 || !self.goes_on(seat) {
            return self.act_once(episode, seat, call, keyed).await;
        }
        let (team, own) = (self.clone(), episode.clone());
        finish_all(episode, keyed, async move { team.act_on(&own, seat, call).await }).await
    }

    async fn act_on(
        self: Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        mut left: OperatorCall,
    ) -> Result<Answer, HostingError> {
        let (mut executed_steps, mut heard) = (0, Vec::new());
        loop {
            let is_cut_off = left.call().steps() > 1 && self.goes_on(seat);
            let part = if is_cut_off { left.clone().unseen() } else { left.clone() };
            let mut answer = self.act_once(episode, seat, part, None).await?;
            let rest = answer.cut_off_steps().and_then(|steps| Some((steps, left.rest(steps)?)));
            match rest.filter(|_| self.goes_on(seat)) {
                Some((steps, rest)) => {
                    left = rest;
                    executed_steps += steps;
                    heard.append(&mut answer.heard);
                }
                None => return Ok(answer.after(executed_steps, heard)),
            }
        }
    }

    /// Notes that the operator of `robot` sends control steps in real time: its partners' commands go on
    /// over them, and the steps' own time is no thinking.
    pub fn pace(&self, robot: &str) -> Result<(), HostingError> {
        let seat = self.seat(robot)?;
        self.round().set_pace(seat, TICK);
        self.wheels().paced.insert(seat);
        Ok(())
    }

    /// Returns true where a command by the operator on `seat` goes on after a shorter one of a partner:
    /// beside people and programs in real time, partners of this process and plans, whose commands are short.
    fn goes_on(&self, seat: usize) -> bool {
        let wheels = self.wheels();
        wheels.partners[seat].is_some()
            || wheels.seats.iter().any(Option::is_some)
            || wheels.paced.iter().any(|paced| *paced != seat)
            || wheels.plans > 0
    }

    /// Takes a command and answers when the step has been made.
    async fn act_once(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        call: OperatorCall,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        self.round().admit(seat)?;
        // A command that cannot be executed is refused before the others depend on it.
        let place = self.take_place(call.robot())?;
        let command = episode.read_command(call).await?;
        drop(place);
        let (reply, answer) = oneshot::channel();
        {
            let mut round = self.round();
            round.admit(seat)?;
            round.command(seat, Pending { command, keyed, reply });
        }
        self.go_on(episode);
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// Lets the operator leave. The episode ends when nobody is left; until then its robot holds still,
    /// and the answer is the episode's status.
    async fn finish(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        keyed: Option<Keyed>,
    ) -> Result<Answer, HostingError> {
        let others_play_on = !episode.ended() && self.round().finish(seat)?;
        let call: ToolCall = match others_play_on {
            true => GetStatus::default().into(),
            false => Finish {}.into(),
        };
        if others_play_on {
            self.go_on(episode);
        }
        let then = move |team: &Team, answer| {
            team.round().has_looked(seat);
            Answer { others_play_on, ..answer }
        };
        self.ask(episode, seat, call.into(), keyed, then).await
    }

    /// Stops execution; waiting operators receive an error.
    pub fn stop(&self) {
        // Dropping the commands ends their replies.
        drop(self.round().begin());
    }

    /// Makes the step if no operator is awaited; otherwise starts the patience timer.
    fn go_on(self: &Arc<Self>, episode: &Arc<EpisodeThread>) {
        let mut round = self.round();
        if !round.may_begin() {
            return;
        }
        if round.awaited().is_empty() {
            self.begin(episode, &mut round);
        } else if !round.is_timed() {
            let (team, episode, number) = (self.clone(), episode.clone(), round.number());
            let waiting = tokio::spawn(async move {
                tokio::time::sleep(team.patience).await;
                let mut round = team.round();
                if round.number() == number && round.may_begin() {
                    round.lose_patience();
                    team.begin(&episode, &mut round);
                }
            });
            round.time(waiting.abort_handle());
        }
    }

    fn begin(self: &Arc<Self>, episode: &Arc<EpisodeThread>, round: &mut Round) {
        let pending = round.begin();
        let (team, episode) = (self.clone(), episode.clone());
        tokio::spawn(async move { team.execute(&episode, pending).await });
    }

    /// Makes the step with the operators that have commanded, and sends each its answer.
    async fn execute(self: Arc<Self>, episode: &Arc<EpisodeThread>, pending: Vec<(usize, Pending)>) {
        let (mut replies, mut commands, mut asked) = (Vec::new(), Vec::new(), Vec::new());
        for (seat, Pending { command, keyed, reply }) in pending {
            asked.push((seat, command.steps(), command.tool()));
            commands.push((command.with_use(self.round().used(seat)), keyed));
            replies.push(reply);
        }
        let (team, is_over) = (self.clone(), Arc::new(AtomicBool::new(false)));
        let over = is_over.clone();
        let told = move |outcome: Result<Vec<Answer>, HostingError>| {
            over.store(true, Relaxed);
            let did = team.round().end(outcome.as_ref().ok().and_then(|answers| answers.first()));
            let tools: Vec<(usize, &'static str)> =
                asked.iter().map(|(seat, _, tool)| (*seat, *tool)).collect();
            let tell = |((seat, asked_steps, _), answer)| {
                let partners = team.partners(seat, &did, &tools);
                Answer { partners, ..team.for_seat(answer, seat) }.cut_off_after(asked_steps)
            };
            outcome.map(|answers| asked.into_iter().zip(answers).map(tell).collect())
        };
        let outcome = episode.together(commands, Box::new(told)).await;
        if !is_over.load(Relaxed) {
            self.round().end(None);
        }
        match outcome {
            Ok(answers) => {
                for (reply, answer) in replies.into_iter().zip(answers) {
                    // The step is recorded even if a caller has gone.
                    let _ = reply.send(Ok(answer));
                }
            }
            Err(error) => {
                let error = Arc::new(error);
                for reply in replies {
                    let _ = reply.send(Err(HostingError::Shared(error.clone())));
                }
            }
        }
        self.go_on(episode);
    }

    /// Restricts the answer to what the operator on `seat` may see.
    fn for_seat(&self, answer: Answer, seat: usize) -> Answer {
        let heard = self.round().take_heard(seat);
        let own = answer.of_own_robot(&self.seats[seat].robot).with_clock_left(self.clock_left_s(seat));
        Answer { heard, ..own }
    }

    /// Returns the behaviour of the partners of `seat`, out of that of all robots in `did`.
    fn partners(&self, seat: usize, did: &[PartnerDid], tools: &[(usize, &'static str)]) -> Vec<Partner> {
        let others = self.seats.iter().zip(did).enumerate().filter(|(other, _)| *other != seat);
        let partner = |(other, (who, did)): (usize, (&Seat, &PartnerDid))| {
            let tool = tools.iter().find(|(seat, _)| *seat == other).map(|(_, tool)| (*tool).to_owned());
            Partner { robot: who.robot.clone(), did: *did, tool }
        };
        others.map(partner).collect()
    }

    /// Refuses a call that names an unknown robot.
    fn check_robots(&self, call: &Call) -> Result<(), EpisodeError> {
        let is_known = |robot: &str| self.seats.iter().any(|seat| seat.robot == robot);
        call.robots()
            .into_iter()
            .find(|robot| !is_known(robot))
            .map_or(Ok(()), |robot| Err(self.unknown(robot)))
    }

    fn unknown(&self, robot: &str) -> EpisodeError {
        let have = self.seats.iter().map(|seat| seat.robot.clone()).collect();
        EpisodeError::UnknownRobot { name: robot.into(), have }
    }

    fn seat(&self, robot: &str) -> Result<usize, HostingError> {
        let found = self.seats.iter().position(|seat| seat.robot == robot);
        found.ok_or_else(|| self.unknown(robot).into())
    }

    fn wheels(&self) -> MutexGuard<'_, Wheels> {
        // Nothing panics while it holds the lock.
        self.wheels.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }

    fn round(&self) -> MutexGuard<'_, Round> {
        // Nothing panics while it holds the lock.
        self.round.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_operator_takes_no_place_of_another() {
        let (team, _) =
            Team::new(["A", "B"].into_iter(), &Driving::default(), None, TeamRules::default()).unwrap();
        let taken: Vec<_> = (0..WAITING_CALLS / 2).map(|_| team.take_place("A").unwrap()).collect();
        let refused = team.take_place("A").unwrap_err();
        assert!(matches!(refused, HostingError::TooManyWaiting { limit: 8 }), "{refused}");
        drop(team.take_place("B").unwrap());
        drop(taken);
        drop(team.take_place("A").unwrap());
    }
}
