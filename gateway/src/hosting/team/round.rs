//! State of a round: the operators and the commands that they have given for the next step.

use std::time::{Duration, Instant};

use serde::{Deserialize, Serialize};
use tandem_episodes::OperatorCommand;
use tandem_tools_spec::{Heard, OperatorUse, PartnerDid, Presence, PresenceState, ToolReply};
use tokio::{sync::oneshot, task::AbortHandle};

use super::{
    clock::{OperatorClock, to_ms},
    setpoint::{Setpoint, Teleoperation},
};
use crate::hosting::{Answer, HostingError, durable::Keyed};

/// Maximum number of unread messages per operator.
const MAX_UNHEARD: usize = 32;

/// State of the operators before a step.
#[derive(Debug, Default)]
pub struct Round {
    /// One operator for each robot, in the episode's order.
    pub operators: Vec<Operator>,
    /// Number of steps executed so far.
    pub number: u64,
    /// Handle that stops the patience timer; `None` while none is running.
    patience: Option<AbortHandle>,
    /// Number of real-time drivers that the team has had so far.
    pub drivers: u64,
    /// True while the Tokio task that turns setpoints into commands runs.
    pub turning: bool,
    /// Number of plans that are being executed.
    pub plans: u32,
}

/// State of the operator of one robot, and of the player in this process that drives the robot, if any.
#[derive(Debug, Default)]
pub struct Operator {
    pub robot: String,
    state: OperatorState,
    /// First and last control step of a hold of the robot that the operator has not been notified of.
    missed: Option<[u32; 2]>,
    heard: Vec<Heard>,
    /// Number of messages that the operator has sent.
    said: u32,
    /// Number of the operator's requests.
    requests: u32,
    clock: OperatorClock,
    /// State of the real-time driver; `None` if the robot has none.
    pub teleoperation: Option<Teleoperation>,
    /// Time at which the real-time driver's pending command was given.
    pub under_way: Option<Instant>,
    /// True for a program that sends one control step after another in real time.
    pub paced: bool,
    /// Expert or policy of this process that drives the robot.
    pub partner: Option<PartnerKind>,
    /// Partner that drove when the previous server ended; `None` after the attempt to restore it.
    pub left: Option<PartnerKind>,
}

/// Kind of player in this process that drives a robot.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartnerKind {
    Expert,
    Policy,
}

/// State of an operator that outlives the server. Commands that have not been executed are not part of it.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
pub struct OperatorMemory {
    silent: bool,
    finished: bool,
    missed: Option<[u32; 2]>,
    heard: Vec<Heard>,
    said: u32,
    #[serde(default)]
    requests: u32,
    #[serde(default)]
    thought: Duration,
    /// Partner that drove in the operator's place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    partner: Option<PartnerKind>,
}

/// State of all operators except one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Others {
    /// At least one other operator plays.
    There,
    /// All other operators are silent or have finished, and at least one is silent.
    Away,
    /// All other operators have finished.
    Gone,
}

#[derive(Debug, Default)]
enum OperatorState {
    #[default]
    Thinking,
    /// The operator has given its command for the next step, which is not executed yet.
    Waiting(Box<Pending>),
    /// The operator's command is being executed.
    Acting,
    /// The operator gave no command within the time limit, so the others no longer wait for it.
    Silent,
    /// The operator has called finish.
    Finished,
}

/// A command that the episode has parsed, and the sender of its reply.
#[derive(Debug)]
pub struct Pending {
    pub command: OperatorCommand,
    pub keyed: Option<Keyed>,
    pub reply: oneshot::Sender<Result<Answer, HostingError>>,
}

impl Round {
    /// Creates the first round, for the operators of `robots`.
    pub fn new<'a>(robots: impl Iterator<Item = &'a str>) -> Round {
        let operator = |robot: &str| Operator { robot: robot.into(), ..Operator::default() };
        Round { operators: robots.map(operator).collect(), ..Round::default() }
    }

    /// Returns the state of each operator that a suspended episode keeps.
    pub fn memory(&self) -> Vec<OperatorMemory> {
        self.operators.iter().map(Operator::memory).collect()
    }

    /// Restores the state of each operator from `memory`.
    pub fn restore(&mut self, memory: Vec<OperatorMemory>) {
        self.operators.iter_mut().zip(memory).for_each(|(operator, memory)| operator.restore(memory));
    }

    /// Returns true if a partner or a real-time driver has a robot, or if a command waits for execution.
    pub fn is_busy(&self) -> bool {
        let drives = |operator: &Operator| {
            operator.partner.or(operator.left).is_some() || operator.teleoperation.is_some()
        };
        self.operators.iter().any(drives) || self.may_begin()
    }

    /// Returns true if a command of the operator at `seat` continues after a partner's shorter command ends.
    /// This is so if the operator is a partner of this process, beside people and programs in real time, and
    /// during plans.
    pub fn goes_on(&self, seat: usize) -> bool {
        self.operators[seat].partner.is_some()
            || self.plans > 0
            || self.operators.iter().any(|operator| operator.teleoperation.is_some())
            || self.others(seat).any(|operator| operator.paced)
    }

    /// Returns the current actions of all operators except the one at `seat`.
    pub fn presence(&self, seat: usize) -> Vec<Presence> {
        self.others(seat).map(Operator::presence).collect()
    }

    /// Checks that the operator at `seat` may command now. An operator whose robot was held is refused once,
    /// with the steps that it missed.
    pub fn admit(&mut self, seat: usize) -> Result<(), HostingError> {
        let waits_for = self.awaited();
        let operator = &mut self.operators[seat];
        let robot = operator.robot.clone();
        match operator.state {
            OperatorState::Waiting(_) | OperatorState::Acting => {
                return Err(HostingError::DoubleCommand { robot, waits_for });
            }
            OperatorState::Finished => return Err(HostingError::OperatorFinished { robot }),
            OperatorState::Silent => operator.state = OperatorState::Thinking,
            OperatorState::Thinking => {}
        }
        match operator.missed.take() {
            Some([from_step, to_step]) => Err(HostingError::LateCommand { robot, from_step, to_step }),
            None => Ok(()),
        }
    }

    /// Marks the operator at `seat` as finished. Returns true if others continue to play.
    pub fn finish(&mut self, seat: usize) -> Result<bool, HostingError> {
        let waits_for = self.awaited();
        let operator = &mut self.operators[seat];
        if let OperatorState::Waiting(_) | OperatorState::Acting = operator.state {
            return Err(HostingError::DoubleCommand { robot: operator.robot.clone(), waits_for });
        }
        operator.state = OperatorState::Finished;
        operator.clock.stop();
        Ok(self
            .operators
            .iter()
            .any(|other| !matches!(other.state, OperatorState::Finished | OperatorState::Silent)))
    }

    /// Returns the robots whose operators have not commanded yet.
    pub fn awaited(&self) -> Vec<String> {
        let thinking =
            self.operators.iter().filter(|operator| matches!(operator.state, OperatorState::Thinking));
        thinking.map(|operator| operator.robot.clone()).collect()
    }

    /// Returns the state of all operators except the one at `seat`.
    pub fn state_of_others(&self, seat: usize) -> Others {
        let all = |of: fn(&OperatorState) -> bool| self.others(seat).all(|operator| of(&operator.state));
        if all(|state| matches!(state, OperatorState::Finished)) {
            Others::Gone
        } else if all(|state| matches!(state, OperatorState::Finished | OperatorState::Silent)) {
            Others::Away
        } else {
            Others::There
        }
    }

    fn others(&self, seat: usize) -> impl Iterator<Item = &Operator> {
        self.operators.iter().enumerate().filter(move |(other, _)| *other != seat).map(|(_, other)| other)
    }

    /// Returns true if a step can begin: an operator has commanded, and no step is being executed.
    pub fn may_begin(&self) -> bool {
        let any = |of: fn(&OperatorState) -> bool| self.operators.iter().any(|operator| of(&operator.state));
        any(|state| matches!(state, OperatorState::Waiting(_)))
            && !any(|state| matches!(state, OperatorState::Acting))
    }

    /// Returns true while the patience timer runs.
    pub fn is_timed(&self) -> bool {
        self.patience.is_some()
    }

    /// Records that the patience timer runs; the handle `patience` stops it.
    pub fn time(&mut self, patience: AbortHandle) {
        self.patience = Some(patience);
    }

    /// Stops waiting for all operators that have not commanded.
    pub fn lose_patience(&mut self) {
        self.operators.iter_mut().for_each(Operator::fall_silent);
    }

    /// Begins a step: stops the patience timer and takes the pending commands with their seats.
    pub fn begin(&mut self) -> Vec<(usize, Pending)> {
        if let Some(patience) = self.patience.take() {
            patience.abort();
        }
        let mut taken = Vec::new();
        for (seat, operator) in self.operators.iter_mut().enumerate() {
            match std::mem::replace(&mut operator.state, OperatorState::Acting) {
                OperatorState::Waiting(pending) => taken.push((seat, *pending)),
                other => operator.state = other,
            }
        }
        taken
    }

    /// Ends the step, which succeeded with `answer` or failed if that is `None`. Returns each robot's
    /// outcome, by seat.
    pub fn end(&mut self, answer: Option<&Answer>) -> Vec<PartnerDid> {
        self.number += 1;
        let made = answer.and_then(|answer| match &answer.reply {
            ToolReply::Act(reply) => {
                answer.step.map(|step| [step.saturating_sub(reply.executed_steps), step])
            }
            ToolReply::Look(_) | ToolReply::Plan(_) | ToolReply::Manage(_) | ToolReply::Talk(_) => None,
        });
        self.operators.iter_mut().map(|operator| operator.end(made)).collect()
    }

    /// Returns an error if a message would exceed `MAX_UNHEARD` for one of its recipients.
    pub fn check_unheard(&self, from: usize) -> Result<(), HostingError> {
        match self.others(from).find(|other| other.heard.len() >= MAX_UNHEARD) {
            Some(other) => {
                Err(HostingError::TooMuchSaid { robot: other.robot.clone(), unheard: MAX_UNHEARD })
            }
            None => Ok(()),
        }
    }

    /// Delivers a message to all operators except `from`.
    pub fn spread(&mut self, from: usize, words: &Heard) {
        for (seat, operator) in self.operators.iter_mut().enumerate() {
            if seat != from {
                operator.heard.push(words.clone());
            }
        }
    }
}

impl Operator {
    fn memory(&self) -> OperatorMemory {
        OperatorMemory {
            silent: matches!(self.state, OperatorState::Silent),
            finished: matches!(self.state, OperatorState::Finished),
            missed: self.missed,
            heard: self.heard.clone(),
            said: self.said,
            requests: self.requests,
            thought: self.clock.spent(),
            partner: self.partner.or(self.left),
        }
    }

    fn restore(&mut self, memory: OperatorMemory) {
        let OperatorMemory { silent, finished, missed, heard, said, requests, thought, partner } = memory;
        (self.missed, self.heard, self.said) = (missed, heard, said);
        self.requests += requests;
        self.clock.add(thought);
        self.left = partner.filter(|_| !finished);
        match self.state {
            // The operator has already called again.
            OperatorState::Waiting(_) | OperatorState::Acting => {}
            _ if finished => self.state = OperatorState::Finished,
            _ if silent => self.state = OperatorState::Silent,
            _ => self.state = OperatorState::Thinking,
        }
    }

    /// Counts a request. The first request starts the operator's clock.
    pub fn arrive(&mut self) {
        self.requests += 1;
        if let OperatorState::Thinking = self.state {
            self.clock.run();
        }
    }

    /// Sets the time after each command that is not charged as thinking.
    pub fn set_pace(&mut self, pace: Duration) {
        self.clock.set_pace(pace);
    }

    /// Returns the driver's setpoint that becomes a command now, if the last command has been answered and
    /// time may pass. The flag is true if the driver receives the robot's state.
    pub fn due(&mut self, now: Instant) -> Option<(Setpoint, bool)> {
        let teleoperation = self.teleoperation.as_mut().filter(|_| self.under_way.is_none())?;
        let due = teleoperation.due(now)?;
        self.under_way = Some(now);
        Some(due)
    }

    /// Returns the number of requests and the thinking time that the operator has used so far.
    pub fn used(&self) -> OperatorUse {
        let thinking_s = to_ms(self.clock.thought());
        OperatorUse { robot: self.robot.clone(), requests: self.requests, thinking_s }
    }

    /// Returns the operator's thinking time so far.
    pub fn thought(&self) -> Duration {
        self.clock.thought()
    }

    /// Stores the operator's command for the next step.
    pub fn command(&mut self, pending: Pending) {
        self.state = OperatorState::Waiting(pending.into());
        self.clock.stop();
    }

    /// Records that the operator has observed the current state, and so needs no notice of a hold.
    pub fn has_looked(&mut self) {
        self.missed = None;
        if let OperatorState::Silent = self.state {
            self.state = OperatorState::Thinking;
            self.clock.run();
        }
    }

    /// Returns an error if the operator has finished.
    pub fn check_plays(&self) -> Result<(), HostingError> {
        match self.state {
            OperatorState::Finished => Err(HostingError::OperatorFinished { robot: self.robot.clone() }),
            OperatorState::Thinking
            | OperatorState::Waiting(_)
            | OperatorState::Acting
            | OperatorState::Silent => Ok(()),
        }
    }

    /// Counts a message that this operator has sent, and returns the number of messages sent before it.
    pub fn count_said(&mut self) -> u32 {
        self.said += 1;
        self.said - 1
    }

    /// Takes the operator's unread messages.
    pub fn take_heard(&mut self) -> Vec<Heard> {
        std::mem::take(&mut self.heard)
    }

    fn presence(&self) -> Presence {
        let state = match self.state {
            OperatorState::Thinking | OperatorState::Silent if self.requests == 0 => PresenceState::Absent,
            OperatorState::Thinking => PresenceState::Thinking,
            OperatorState::Waiting(_) => PresenceState::Waiting,
            OperatorState::Acting => PresenceState::Acting,
            OperatorState::Silent => PresenceState::Silent,
            OperatorState::Finished => PresenceState::Finished,
        };
        let thinking_s = self.clock.running().map(|thought| (thought.as_secs_f64() * 10.0).round() / 10.0);
        Presence { robot: self.robot.clone(), state, thinking_s }
    }

    /// Marks the operator as silent if it is thinking. The others do not wait for it until it calls again.
    pub fn fall_silent(&mut self) {
        if let OperatorState::Thinking = self.state {
            self.state = OperatorState::Silent;
            self.clock.stop();
        }
    }

    /// Ends a step for this operator and returns its outcome. `made` is the first and last control step
    /// executed; `None` after a failure.
    fn end(&mut self, made: Option<[u32; 2]>) -> PartnerDid {
        match self.state {
            OperatorState::Acting => {
                self.state = OperatorState::Thinking;
                self.clock.run();
                PartnerDid::Acted
            }
            OperatorState::Finished => PartnerDid::HeldFinished,
            // The operator gave this command while the step was being executed, so it is for the next step.
            OperatorState::Waiting(_) => PartnerDid::HeldSilent,
            OperatorState::Thinking | OperatorState::Silent => {
                if let Some([from_step, to_step]) = made {
                    self.missed.get_or_insert([from_step, to_step])[1] = to_step;
                }
                PartnerDid::HeldSilent
            }
        }
    }
}
