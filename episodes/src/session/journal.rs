//! The journal of an episode: its requests, which another process can repeat to restore its state.
//! Observations are included, since they count, cost time and are recorded. Replies are not, since they
//! can be reproduced.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tandem_tools_spec::{EndReason, ExtraInformation, Note};

use super::Session;
use crate::commands::{Called, OperatorCall};
use crate::recording::state_hash_text;

/// A request with its arrival time and its result.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// The policy's thinking time when the request came, in nanoseconds.
    thought_ns: u64,
    pub(super) asked: KeptRequest,
    /// State of the world after the request, if the request changed it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) state: Option<StateMark>,
    /// Reason for the end of the episode, if it had ended by that time.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndReason>,
}

/// A state of the world, for comparisons.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StateMark {
    pub(super) control_step: u64,
    state_hash: String,
}

/// A request to an episode, in the journal's form. Arguments are JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeptRequest {
    /// A call of [`Session::perform`].
    Call {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        operator: Option<String>,
        /// Extra information shown to a policy in this process; `None` if the caller itself reads the answer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shown: Option<Vec<ExtraInformation>>,
        tool: String,
        arguments: String,
    },
    /// A call of [`Session::read_command`] that was refused.
    Command { robot: String, tool: String, arguments: String },
    /// A call of [`Session::note`].
    Note { operator: Option<String>, note: Note },
    /// A call of [`Session::refused_before`].
    Refused { operator: Option<String>, tool: String, arguments: String, problem: String },
    /// A call of [`Session::end`].
    End { reason: EndReason },
}

/// Entries written since they were last taken.
#[derive(Default)]
pub struct Journal {
    entries: Vec<JournalEntry>,
    /// Step of the last mark.
    marked_step: u64,
    /// Reason why an entry is missing.
    failed: Option<String>,
}

/// A request and the policy's thinking time at its arrival; `None` without a journal.
pub(super) type Arrival = Option<(Duration, Result<KeptRequest, serde_json::Error>)>;

impl JournalEntry {
    /// Returns the control step of the world after the request, if it had moved.
    pub fn control_step(&self) -> Option<u64> {
        self.state.as_ref().map(|state| state.control_step)
    }

    /// Returns the policy's thinking time at the request's arrival.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought_ns)
    }
}

impl Session {
    /// Starts a journal, to be read by [`Session::take_journal`].
    pub fn keep_journal(&mut self) {
        self.journal = Some(Journal { marked_step: self.present.control_step, ..Journal::default() });
    }

    /// Takes the entries written since the last call.
    ///
    /// # Errors
    ///
    /// Returns the reason why an entry is missing. The journal cannot be used then.
    pub fn take_journal(&mut self) -> Result<Vec<JournalEntry>, String> {
        let Some(journal) = &mut self.journal else { return Ok(Vec::new()) };
        match journal.failed.take() {
            Some(why) => Err(why),
            None => Ok(std::mem::take(&mut journal.entries)),
        }
    }

    /// Returns the current request with the policy's thinking time, if a journal is kept.
    pub(super) fn arrival(&self, asked: impl FnOnce() -> Result<KeptRequest, serde_json::Error>) -> Arrival {
        self.journal.as_ref().map(|_| (self.clock.spent() + self.clock.thinking(), asked()))
    }

    /// Writes the entry of a request, with its result.
    pub(super) fn write_down(&mut self, arrival: Arrival) {
        let Some((thought, asked)) = arrival else { return };
        let (step, ended) = (self.present.control_step, self.ended);
        let has_moved = self.journal.as_ref().is_some_and(|journal| journal.marked_step != step);
        let state = has_moved.then(|| self.state_mark());
        let Some(journal) = &mut self.journal else { return };
        journal.marked_step = step;
        match asked {
            Ok(asked) => journal.entries.push(JournalEntry {
                thought_ns: u64::try_from(thought.as_nanos()).unwrap_or(u64::MAX),
                asked,
                state,
                ended,
            }),
            Err(error) => drop(journal.failed.get_or_insert(error.to_string())),
        }
    }

    pub(super) fn state_mark(&self) -> StateMark {
        StateMark {
            control_step: self.present.control_step,
            state_hash: state_hash_text(self.world.state_hash()),
        }
    }
}

impl KeptRequest {
    pub(super) fn call(
        operator: Option<&str>,
        shown: Option<&[ExtraInformation]>,
        called: &Called,
    ) -> Result<KeptRequest, serde_json::Error> {
        Ok(KeptRequest::Call {
            operator: operator.map(str::to_owned),
            shown: shown.map(<[_]>::to_vec),
            tool: called.name().into(),
            arguments: called.arguments()?,
        })
    }

    pub(super) fn command(call: &OperatorCall) -> Result<KeptRequest, serde_json::Error> {
        let (robot, call) = (call.robot().into(), call.call());
        Ok(KeptRequest::Command { robot, tool: call.name().into(), arguments: serde_json::to_string(call)? })
    }

    pub(super) fn note(operator: Option<&str>, note: &Note) -> Result<KeptRequest, serde_json::Error> {
        Ok(KeptRequest::Note { operator: operator.map(str::to_owned), note: note.clone() })
    }

    pub(super) fn refused(
        operator: Option<&str>,
        [tool, arguments, problem]: [&str; 3],
    ) -> Result<KeptRequest, serde_json::Error> {
        let [tool, arguments, problem] = [tool, arguments, problem].map(str::to_owned);
        Ok(KeptRequest::Refused { operator: operator.map(str::to_owned), tool, arguments, problem })
    }

    pub(super) fn end(reason: EndReason) -> Result<KeptRequest, serde_json::Error> {
        Ok(KeptRequest::End { reason })
    }
}
