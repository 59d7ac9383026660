//! The journal of an episode: what it has been asked, so that another process can bring it to where it stands
//! by asking the same again. Looks are in it as well, since they count, cost time and are recorded. What has
//! been answered is not: it comes to the same.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tandem_tools_spec::{EndReason, ExtraInformation, Note};

use super::Session;
use crate::commands::{Called, OperatorCall};
use crate::recording::state_hash_text;

/// One request, when it came, and where it led.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// The policy's thinking time when the request came, in nanoseconds.
    thought_ns: u64,
    pub(super) asked: KeptRequest,
    /// The world afterwards, where it has moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) state: Option<StateMark>,
    /// Why the episode had ended by then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndReason>,
}

/// A state of the world, to tell whether another is the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StateMark {
    pub(super) control_step: u64,
    state_hash: String,
}

/// A request to an episode, in the form that a journal keeps. Arguments are JSON.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum KeptRequest {
    /// [`Session::perform`].
    Call {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        operator: Option<String>,
        /// The extra information that a policy in this process is shown; `None` where the caller itself reads
        /// the answer.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shown: Option<Vec<ExtraInformation>>,
        tool: String,
        arguments: String,
    },
    /// [`Session::read_command`], where that has refused.
    Command { robot: String, tool: String, arguments: String },
    /// [`Session::note`].
    Note { operator: Option<String>, note: Note },
    /// [`Session::refused_before`].
    Refused { operator: Option<String>, tool: String, arguments: String, problem: String },
    /// [`Session::end`].
    End { reason: EndReason },
}

/// Entries that a session has written down and nobody has taken yet.
#[derive(Default)]
pub struct Journal {
    entries: Vec<JournalEntry>,
    /// The step of the last mark.
    marked_step: u64,
    /// The reason why an entry is missing.
    failed: Option<String>,
}

/// A request and the policy's thinking time when it came; `None` where no journal is kept.
pub(super) type Arrival = Option<(Duration, Result<KeptRequest, serde_json::Error>)>;

impl JournalEntry {
    /// Returns the control step that the world had come to, where it had moved.
    pub fn control_step(&self) -> Option<u64> {
        self.state.as_ref().map(|state| state.control_step)
    }

    /// Returns the policy's thinking time when the request came.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought_ns)
    }
}

impl Session {
    /// Writes down from now on what is asked, for [`Session::take_journal`].
    pub fn keep_journal(&mut self) {
        self.journal = Some(Journal { marked_step: self.present.control_step, ..Journal::default() });
    }

    /// Takes the entries written since the last call. An error means that an entry is missing: the journal is
    /// then worthless.
    pub fn take_journal(&mut self) -> Result<Vec<JournalEntry>, String> {
        let Some(journal) = &mut self.journal else { return Ok(Vec::new()) };
        match journal.failed.take() {
            Some(why) => Err(why),
            None => Ok(std::mem::take(&mut journal.entries)),
        }
    }

    /// What has come, if a journal is kept.
    pub(super) fn arrival(&self, asked: impl FnOnce() -> Result<KeptRequest, serde_json::Error>) -> Arrival {
        self.journal.as_ref().map(|_| (self.clock.spent() + self.clock.thinking(), asked()))
    }

    /// Writes down what had come, and where it has led.
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
