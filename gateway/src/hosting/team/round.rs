//! The state of a round: the commands that operators have given for the next step.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tandem_episodes::OperatorCommand;
use tandem_tools_spec::{Heard, OperatorUse, PartnerDid, Presence, PresenceState, ToolReply};
use tokio::{sync::oneshot, task::AbortHandle};

use super::clock::{OperatorClock, to_ms};
use crate::hosting::{Answer, HostingError, durable::Keyed};

/// Maximum number of unread messages for one operator.
const MAX_UNHEARD: usize = 32;

/// The operators before a step, by seat.
#[derive(Debug)]
pub struct Round {
    operators: Vec<Operator>,
    /// Number of steps that have been made.
    number: u64,
    /// Handle that stops the patience timer; `None` while none is running.
    patience: Option<AbortHandle>,
}

#[derive(Debug)]
struct Operator {
    robot: String,
    state: OperatorState,
    /// First and last step through which its robot was held without its knowledge.
    missed: Option<[u32; 2]>,
    heard: Vec<Heard>,
    /// Number of messages it has sent.
    said: u32,
    /// Number of its requests.
    requests: u32,
    clock: OperatorClock,
}

/// Driver of a robot that runs in this process.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PartnerKind {
    Expert,
    Policy,
}

/// State of an operator that outlives the server; commands that have not been executed do not.
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
    /// Partner that drove in its place.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub partner: Option<PartnerKind>,
}

impl OperatorMemory {
    /// Returns the partner that drove and has not finished.
    pub fn left(&self) -> Option<PartnerKind> {
        self.partner.filter(|_| !self.finished)
    }
}

/// State of the other operators, as seen by one.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Company {
    /// At least one plays.
    There,
    /// None has commanded within the others' patience.
    Away,
    /// All have finished.
    Gone,
}

#[derive(Debug)]
enum OperatorState {
    Thinking,
    /// The operator has commanded; the step is not made yet.
    Waiting(Box<Pending>),
    /// The operator's command is being executed.
    Acting,
    /// The operator has used up the others' patience; they do not wait for it.
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
    pub fn new(robots: Vec<String>) -> Round {
        let operator = |robot| Operator {
            robot,
            state: OperatorState::Thinking,
            missed: None,
            heard: Vec::new(),
            said: 0,
            requests: 0,
            clock: OperatorClock::default(),
        };
        Round { operators: robots.into_iter().map(operator).collect(), number: 0, patience: None }
    }

    /// Returns the state that has to be remembered, by seat.
    pub fn memory(&self) -> Vec<OperatorMemory> {
        let memory = |operator: &Operator| OperatorMemory {
            silent: matches!(operator.state, OperatorState::Silent),
            finished: matches!(operator.state, OperatorState::Finished),
            missed: operator.missed,
            heard: operator.heard.clone(),
            said: operator.said,
            requests: operator.requests,
            thought: operator.clock.spent(),
            partner: None,
        };
        self.operators.iter().map(memory).collect()
    }

    /// Restores what was remembered.
    pub fn restore(&mut self, memory: Vec<OperatorMemory>) {
        for (operator, memory) in self.operators.iter_mut().zip(memory) {
            let OperatorMemory { silent, finished, missed, heard, said, requests, thought, partner: _ } =
                memory;
            (operator.missed, operator.heard, operator.said) = (missed, heard, said);
            operator.requests += requests;
            operator.clock.add(thought);
            match operator.state {
                // It has already called again.
                OperatorState::Waiting(_) | OperatorState::Acting => {}
                _ if finished => operator.state = OperatorState::Finished,
                _ if silent => operator.state = OperatorState::Silent,
                _ => operator.state = OperatorState::Thinking,
            }
        }
    }

    /// Sets the time after each command of the operator on `seat` that counts as pacing.
    pub fn set_pace(&mut self, seat: usize, pace: Duration) {
        self.operators[seat].clock.set_pace(pace);
    }

    /// Counts a request of the operator on `seat`, whose clock begins with its first.
    pub fn arrive(&mut self, seat: usize) {
        let operator = &mut self.operators[seat];
        operator.requests += 1;
        if let OperatorState::Thinking = operator.state {
            operator.clock.run();
        }
    }

    /// Returns what the operator on `seat` has used up to now.
    pub fn used(&self, seat: usize) -> OperatorUse {
        let Operator { robot, requests, clock, .. } = &self.operators[seat];
        OperatorUse { robot: robot.clone(), requests: *requests, thinking_s: to_ms(clock.thought()) }
    }

    /// Returns what the operators on other seats than `seat` do.
    pub fn presence(&self, seat: usize) -> Vec<Presence> {
        let others = self.operators.iter().enumerate().filter(|(other, _)| *other != seat);
        others.map(|(_, operator)| operator.presence()).collect()
    }

    /// Returns the time that the operator on `seat` has thought.
    pub fn thought(&self, seat: usize) -> Duration {
        self.operators[seat].clock.thought()
    }

    pub fn number(&self) -> u64 {
        self.number
    }

    /// Checks that the operator on `seat` may command now. One that kept silent is refused once, with the
    /// steps that it missed.
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

    pub fn command(&mut self, seat: usize, pending: Pending) {
        let operator = &mut self.operators[seat];
        operator.state = OperatorState::Waiting(pending.into());
        operator.clock.stop();
    }

    /// Records that the operator on `seat` has looked at the current state.
    pub fn has_looked(&mut self, seat: usize) {
        let operator = &mut self.operators[seat];
        operator.missed = None;
        if let OperatorState::Silent = operator.state {
            operator.state = OperatorState::Thinking;
            operator.clock.run();
        }
    }

    /// Refuses an operator that has finished.
    pub fn check_plays(&self, seat: usize) -> Result<(), HostingError> {
        let operator = &self.operators[seat];
        match operator.state {
            OperatorState::Finished => Err(HostingError::OperatorFinished { robot: operator.robot.clone() }),
            OperatorState::Thinking
            | OperatorState::Waiting(_)
            | OperatorState::Acting
            | OperatorState::Silent => Ok(()),
        }
    }

    /// Stops waiting for the operator on `seat` until it calls again.
    pub fn fall_silent(&mut self, seat: usize) {
        self.operators[seat].fall_silent();
    }

    /// Lets the operator on `seat` leave. Returns true if others play on.
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

    /// Returns the state of the operators on other seats than `seat`.
    pub fn company(&self, seat: usize) -> Company {
        let others = self.operators.iter().enumerate().filter(|(other, _)| *other != seat);
        let states: Vec<&OperatorState> = others.map(|(_, operator)| &operator.state).collect();
        if states.iter().all(|state| matches!(state, OperatorState::Finished)) {
            return Company::Gone;
        }
        let away = |state: &&OperatorState| matches!(state, OperatorState::Finished | OperatorState::Silent);
        if states.iter().all(away) { Company::Away } else { Company::There }
    }

    /// Returns true if a step can be made: an operator has commanded, and no step is being made.
    pub fn may_begin(&self) -> bool {
        let any = |of: fn(&OperatorState) -> bool| self.operators.iter().any(|operator| of(&operator.state));
        any(|state| matches!(state, OperatorState::Waiting(_)))
            && !any(|state| matches!(state, OperatorState::Acting))
    }

    /// Returns true while the patience timer runs.
    pub fn is_timed(&self) -> bool {
        self.patience.is_some()
    }

    /// Starts the patience timer; `patience` stops it.
    pub fn time(&mut self, patience: AbortHandle) {
        self.patience = Some(patience);
    }

    /// Stops waiting for all operators that have not commanded.
    pub fn lose_patience(&mut self) {
        self.operators.iter_mut().for_each(Operator::fall_silent);
    }

    /// Takes the commands of the step that is made now, by seat.
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

    /// Ends the step, which has been made with `answer` or has failed. Returns what each robot did, by
    /// seat.
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

    /// Refuses a message that would exceed `MAX_UNHEARD` for one of its recipients.
    pub fn check_unheard(&self, from: usize) -> Result<(), HostingError> {
        let others = self.operators.iter().enumerate().filter(|(seat, _)| *seat != from);
        match others.map(|(_, other)| other).find(|other| other.heard.len() >= MAX_UNHEARD) {
            Some(other) => {
                Err(HostingError::TooMuchSaid { robot: other.robot.clone(), unheard: MAX_UNHEARD })
            }
            None => Ok(()),
        }
    }

    /// Counts a message of the operator on `seat`, and returns the number of its earlier ones.
    pub fn count_said(&mut self, seat: usize) -> u32 {
        let said = &mut self.operators[seat].said;
        *said += 1;
        *said - 1
    }

    /// Delivers a message to all operators except `from`.
    pub fn spread(&mut self, from: usize, words: &Heard) {
        for (seat, operator) in self.operators.iter_mut().enumerate() {
            if seat != from {
                operator.heard.push(words.clone());
            }
        }
    }

    /// Takes the unread messages of the operator on `seat`.
    pub fn take_heard(&mut self, seat: usize) -> Vec<Heard> {
        std::mem::take(&mut self.operators[seat].heard)
    }
}

impl Operator {
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

    /// Lets nobody wait for it any more, if it thinks.
    fn fall_silent(&mut self) {
        if let OperatorState::Thinking = self.state {
            self.state = OperatorState::Silent;
            self.clock.stop();
        }
    }

    /// Ends a step that was made from the first to the second of `made`.
    fn end(&mut self, made: Option<[u32; 2]>) -> PartnerDid {
        match self.state {
            OperatorState::Acting => {
                self.state = OperatorState::Thinking;
                self.clock.run();
                PartnerDid::Acted
            }
            OperatorState::Finished => PartnerDid::HeldFinished,
            // It has looked and commanded again while the step was made; the command is for the next
            // step.
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
