//! The journal of an episode: what it has been asked, so that another process can bring it to where it stands by asking the same again.
//! Looks are in it as well, since they count, cost time and are recorded. What has been answered is not: it comes to the same.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use serde_json::Value;
use tandem_tools_spec::{EndReason, ExtraInformation, Note};

use super::set_clock::SetHands;
use crate::commands::{Called, OperatorCall};
use crate::error::{CheckpointError, EpisodeError};
use crate::live::Onlookers;
use crate::recording::state_hash_text;
use crate::session::{Audience, Caller, Clock, Request, RunFolder, Session, this_build};
use crate::spec::EpisodeSpec;

/// One request, when it came, and where it led.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JournalEntry {
    /// How long the policy had thought by then, in nanoseconds.
    thought_ns: u64,
    asked: Asked,
    /// The world afterwards, where it has moved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    state: Option<StateMark>,
    /// Why the episode had ended by then.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<EndReason>,
}

/// A state of the world, to tell whether another is the same.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
struct StateMark {
    control_step: u64,
    state_hash: String,
}

/// What an episode may be asked.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Asked {
    /// [`Session::perform`].
    Call {
        #[serde(default, skip_serializing_if = "Option::is_none")]
        operator: Option<String>,
        /// What a policy in this process is shown, where it asks and not its caller.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        shown: Option<Vec<ExtraInformation>>,
        tool: String,
        arguments: Value,
    },
    /// [`Session::read_command`], where that has refused.
    Command { robot: String, tool: String, arguments: Value },
    /// [`Session::note`].
    Note { operator: Option<String>, note: Note },
    /// [`Session::refused_before`].
    Refused { operator: Option<String>, tool: String, arguments: String, problem: String },
    /// [`Session::end`].
    End { reason: EndReason },
}

/// What a session writes down until somebody takes it.
#[derive(Default)]
pub struct Journal {
    entries: Vec<JournalEntry>,
    /// The step of the last mark.
    marked_step: u64,
    /// Why something could not be written down.
    failed: Option<String>,
}

/// What came, and when; nothing where no journal is kept.
pub(in crate::session) type Arrival = Option<(Duration, Result<Asked, serde_json::Error>)>;

/// An episode that another process has played, or this one before it put the episode aside.
pub struct BringBack {
    pub spec: EpisodeSpec,
    /// Where it is recorded from its beginning on.
    pub folder: Option<RunFolder>,
    pub entries: Vec<JournalEntry>,
    /// The policy's wall clock from the last entry on.
    pub clock: Clock,
    /// How long the policy has been thinking since then.
    pub thinking: Duration,
    pub onlookers: Box<dyn Onlookers>,
}

impl JournalEntry {
    /// The control step that the world had come to, where it has moved.
    pub fn control_step(&self) -> Option<u64> {
        self.state.as_ref().map(|state| state.control_step)
    }

    /// How long the policy had thought when the request came.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought_ns)
    }
}

impl Session {
    /// Writes down from now on what is asked, for [`Session::take_journal`].
    pub fn keep_journal(&mut self) {
        self.journal = Some(Journal { marked_step: self.present.control_step, ..Journal::default() });
    }

    /// What has been asked since this was last called. An error says that something is missing, and the journal with it worthless.
    pub fn take_journal(&mut self) -> Result<Vec<JournalEntry>, String> {
        let Some(journal) = &mut self.journal else { return Ok(Vec::new()) };
        match journal.failed.take() {
            Some(why) => Err(why),
            None => Ok(std::mem::take(&mut journal.entries)),
        }
    }

    /// Plays an episode again up to the last entry of its journal, and goes on from there. An error says where it went another way.
    pub fn bring_back(back: BringBack) -> Result<Session, EpisodeError> {
        let BringBack { spec, folder, entries, clock, thinking, onlookers } = back;
        let hands = SetHands::default();
        let path = folder.as_ref().map(|folder| folder.path.clone()).unwrap_or_default();
        let mut session = Session::start_with_clock(&spec, folder, hands.clock(clock))?;
        session.set_onlookers(onlookers);
        for entry in entries {
            let shown = session.clock.spent() + session.clock.thinking();
            hands.pass(entry.thought().saturating_sub(shown));
            entry.asked.ask(&mut session)?;
            let Some(state) = entry.state else { continue };
            if session.state_mark() != state {
                let (step, this) = (state.control_step, this_build()?);
                return Err(CheckpointError::OtherWay { path, step, made_by: this.into(), this }.into());
            }
        }
        hands.pass(thinking);
        hands.go();
        // The clock goes from this look on.
        session.clock.thinking();
        session.keep_journal();
        Ok(session)
    }

    /// What has come, if a journal is kept.
    pub(in crate::session) fn arrival(
        &self,
        asked: impl FnOnce() -> Result<Asked, serde_json::Error>,
    ) -> Arrival {
        self.journal.as_ref().map(|_| (self.clock.spent() + self.clock.thinking(), asked()))
    }

    /// Writes down what had come, and where it has led.
    pub(in crate::session) fn write_down(&mut self, arrival: Arrival) {
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

    fn state_mark(&self) -> StateMark {
        StateMark {
            control_step: self.present.control_step,
            state_hash: state_hash_text(self.world.state_hash()),
        }
    }
}

impl Asked {
    pub(in crate::session) fn request(request: &Request) -> Result<Asked, serde_json::Error> {
        let Request { caller, called, audience } = request;
        Ok(Asked::Call {
            operator: caller.operator().map(str::to_owned),
            shown: match audience {
                Audience::Caller => None,
                Audience::Process(shown) => Some(shown.to_vec()),
            },
            tool: called.name().into(),
            arguments: serde_json::from_str(&called.arguments()?)?,
        })
    }

    pub(in crate::session) fn command(call: &OperatorCall) -> Result<Asked, serde_json::Error> {
        let (robot, call) = (call.robot().into(), call.call());
        Ok(Asked::Command { robot, tool: call.name().into(), arguments: serde_json::to_value(call)? })
    }

    pub(in crate::session) fn note(operator: Option<&str>, note: &Note) -> Result<Asked, serde_json::Error> {
        Ok(Asked::Note { operator: operator.map(str::to_owned), note: note.clone() })
    }

    pub(in crate::session) fn refused(
        operator: Option<&str>,
        [tool, arguments, problem]: [&str; 3],
    ) -> Result<Asked, serde_json::Error> {
        let [tool, arguments, problem] = [tool, arguments, problem].map(str::to_owned);
        Ok(Asked::Refused { operator: operator.map(str::to_owned), tool, arguments, problem })
    }

    pub(in crate::session) fn end(reason: EndReason) -> Result<Asked, serde_json::Error> {
        Ok(Asked::End { reason })
    }

    /// Asks it again. What was refused is refused again, so that a refusal is no error.
    fn ask(self, session: &mut Session) -> Result<(), EpisodeError> {
        match self {
            Asked::Call { operator, shown, tool, arguments } => {
                let caller = operator.as_deref().map_or(Caller::Policy, Caller::Operator);
                let audience = shown.as_deref().map_or(Audience::Caller, Audience::Process);
                let called = Called::parse(&tool, arguments)?;
                let _ = session.perform(Request { caller, called, audience });
            }
            Asked::Command { robot, tool, arguments } => {
                let call = tandem_tools_spec::Call::parse(&tool, arguments)?;
                let _ = session.read_command(OperatorCall::new(&robot, call)?);
            }
            Asked::Note { operator, note } => {
                let _ = session.note(operator.as_deref(), note);
            }
            Asked::Refused { operator, tool, arguments, problem } => {
                session.refused_before(operator.as_deref(), &tool, &arguments, &problem);
            }
            Asked::End { reason } => session.end(reason),
        }
        Ok(())
    }
}
