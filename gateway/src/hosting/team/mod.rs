//! The operators of an episode in which each robot has one of its own.
//!
//! A step is made when every operator has commanded, or when one has and the others' patience is at its end: then the robots of
//! those who kept silent hold still, and nobody waits for them until they call again. The shortest of the commands ends them all.
//! The policy's clock runs until the step is made, so while at least one operator thinks. An operator's call blocks until its
//! robot's reply is there.

mod reply;
mod round;

use std::{
    sync::{Arc, Mutex, MutexGuard},
    time::Duration,
};

use tandem_episodes::{OperatorCommand, own_call};
use tandem_tools_spec::{
    ActCall, Asked, Driving, Finish, GetStatus, Heard, Look, LookCall, ManageCall, OperatorToken, Partner,
    PartnerDid, Say, ToolCall,
};
use tokio::sync::oneshot;

use super::{Answer, EpisodeThread, HostingError};
use crate::token::Token;
use round::{Pending, Round};

/// The operators of one episode.
#[derive(Debug)]
pub struct Team {
    seats: Vec<Seat>,
    patience: Duration,
    talk: bool,
    round: Mutex<Round>,
}

/// Who drives which robot.
#[derive(Debug)]
struct Seat {
    robot: String,
    token: Token,
}

impl Team {
    /// An operator for each of `robots`, and what each needs.
    pub fn new<'a>(
        robots: impl Iterator<Item = &'a str>,
        driving: &Driving,
    ) -> Result<(Team, Vec<OperatorToken>), HostingError> {
        let (mut seats, mut tokens) = (Vec::new(), Vec::new());
        for robot in robots {
            let (token, text) = Token::random()?;
            seats.push(Seat { robot: robot.into(), token });
            tokens.push(OperatorToken { robot: robot.into(), token: text });
        }
        let round = Mutex::new(Round::new(seats.iter().map(|seat| seat.robot.clone()).collect()));
        let patience = Duration::from_secs_f64(driving.patience_s());
        Ok((Team { seats, patience, talk: driving.talk == Some(true), round }, tokens))
    }

    /// The robot whose operator has the token `text`; every token is compared.
    pub fn robot_of(&self, text: &str) -> Option<&str> {
        let mut robot = None;
        for seat in &self.seats {
            if seat.token.matches(text) {
                robot = Some(seat.robot.as_str());
            }
        }
        robot
    }

    /// Whether operators may talk.
    pub fn may_talk(&self) -> bool {
        self.talk
    }

    /// Answers a call of the operator of `robot`.
    pub async fn call(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        robot: &str,
        asked: Asked,
    ) -> Result<Answer, HostingError> {
        let seat = self.seat(robot)?;
        let answer = match own_call(asked.call, robot)? {
            ToolCall::Act(call) => {
                let then = asked.then.map(|look| own_look(look, robot)).transpose()?;
                return self.act(episode, seat, call, asked.expected_step, then).await;
            }
            ToolCall::Manage(ManageCall::Finish(_)) => self.finish(episode, seat).await?,
            call => episode.ask(Some(robot), Asked { formats: asked.formats, ..Asked::from(call) }).await?,
        };
        self.round().has_looked(seat);
        Ok(self.told(answer, seat))
    }

    /// Lets the others hear what the operator of `robot` says.
    pub async fn say(
        &self,
        episode: &Arc<EpisodeThread>,
        robot: &str,
        say: Say,
    ) -> Result<Answer, HostingError> {
        let seat = self.seat(robot)?;
        if !self.talk {
            return Err(HostingError::NoTalk);
        }
        self.round().check_unheard(seat)?;
        let answer = episode.say(robot, say.clone()).await?;
        self.round().spread(seat, &Heard { from: robot.into(), text: say.text });
        Ok(self.told(answer, seat))
    }

    /// Takes a command, and answers when the step has been made.
    async fn act(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
        call: ActCall,
        expected_step: Option<u32>,
        then: Option<Look>,
    ) -> Result<Answer, HostingError> {
        let command = OperatorCommand { robot: self.seats[seat].robot.clone(), call };
        self.round().admit(seat)?;
        // What cannot be executed is refused before the others depend on it.
        episode.check(command.clone(), expected_step, then.clone()).await?;
        let (reply, answer) = oneshot::channel();
        {
            let mut round = self.round();
            round.admit(seat)?;
            round.command(seat, Pending { command, then, reply });
        }
        self.go_on(episode);
        answer.await.map_err(|_| HostingError::EpisodeStopped)?
    }

    /// The operator leaves: the episode ends when nobody is left; until then its robot holds still, and the answer is where the
    /// episode stands.
    async fn finish(
        self: &Arc<Self>,
        episode: &Arc<EpisodeThread>,
        seat: usize,
    ) -> Result<Answer, HostingError> {
        let robot = Some(self.seats[seat].robot.as_str());
        let others_play_on = !episode.ended() && self.round().finish(seat)?;
        if !others_play_on {
            return episode.ask(robot, Asked::from(ToolCall::from(Finish {}))).await;
        }
        self.go_on(episode);
        let status = episode.ask(robot, Asked::from(ToolCall::from(GetStatus {}))).await?;
        Ok(Answer { others_play_on, ..status })
    }

    /// Nothing is executed any more: whoever waits is told so.
    pub fn stop(&self) {
        // Their replies end with their commands.
        drop(self.round().begin());
    }

    /// Makes the step if nobody has to be waited for, or else begins to wait.
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

    /// Makes the step, whoever of its operators is still there, and tells each what became of it.
    async fn execute(self: Arc<Self>, episode: &Arc<EpisodeThread>, pending: Vec<(usize, Pending)>) {
        let commands: Vec<OperatorCommand> =
            pending.iter().map(|(_, pending)| pending.command.clone()).collect();
        let looks = pending.iter().map(|(_, pending)| pending.then.clone()).collect();
        let asked_steps: Vec<u32> = commands.iter().map(OperatorCommand::asked_steps).collect();
        let outcome = episode.together(commands, looks).await;
        let did = self.round().end(outcome.as_ref().ok().and_then(|answers| answers.first()));
        match outcome {
            Ok(answers) => {
                for (((seat, pending), answer), asked_steps) in
                    pending.into_iter().zip(answers).zip(asked_steps)
                {
                    let partners = self.partners(seat, &did);
                    let answer = reply::cut_off(Answer { partners, ..self.told(answer, seat) }, asked_steps);
                    // A caller that has gone has its robot's step recorded all the same.
                    let _ = pending.reply.send(Ok(answer));
                }
            }
            Err(error) => {
                let error = Arc::new(error);
                for (_, pending) in pending {
                    let _ = pending.reply.send(Err(HostingError::Shared(error.clone())));
                }
            }
        }
        self.go_on(episode);
    }

    /// The answer as the operator on `seat` is told it.
    fn told(&self, answer: Answer, seat: usize) -> Answer {
        let heard = self.round().take_heard(seat);
        Answer { heard, ..reply::of_own_robot(answer, &self.seats[seat].robot) }
    }

    /// What the partners of `seat` did, where `did` has it of everyone.
    fn partners(&self, seat: usize, did: &[PartnerDid]) -> Vec<Partner> {
        let all = self.seats.iter().zip(did).enumerate().filter(|(other, _)| *other != seat);
        all.map(|(_, (other, did))| Partner { robot: other.robot.clone(), did: *did }).collect()
    }

    fn seat(&self, robot: &str) -> Result<usize, HostingError> {
        let found = self.seats.iter().position(|seat| seat.robot == robot);
        found.ok_or(HostingError::NeedsOperator)
    }

    fn round(&self) -> MutexGuard<'_, Round> {
        // Nothing panics while it holds the lock.
        self.round.lock().unwrap_or_else(|poisoned| poisoned.into_inner())
    }
}

fn own_look(look: Look, robot: &str) -> Result<Look, HostingError> {
    match own_call(look.call(), robot)? {
        ToolCall::Look(LookCall::Observe(observe)) => Ok(Look { observe, ..look }),
        _ => Ok(look),
    }
}
