//! Restoration of an episode that this process or another one has suspended.

use std::time::Duration;

use serde_json::Value;
use tandem_tools_spec::Call;

use super::set_clock::SetHands;
use crate::commands::{Called, OperatorCall};
use crate::error::{CheckpointError, EpisodeError};
use crate::live::Onlookers;
use crate::output::OutputError;
use crate::session::journal::{JournalEntry, KeptRequest};
use crate::session::{Audience, Caller, Clock, Request, RunFolder, Session, this_build};
use crate::spec::EpisodeSpec;

/// Inputs of the restoration of an episode.
pub struct BringBack {
    pub spec: EpisodeSpec,
    /// Folder of the recording, which starts from the beginning.
    pub folder: Option<RunFolder>,
    pub entries: Vec<JournalEntry>,
    /// The policy's wall clock after the last entry.
    pub clock: Clock,
    /// The policy's thinking time since then.
    pub thinking: Duration,
    pub onlookers: Box<dyn Onlookers>,
}

impl Session {
    /// Repeats an episode up to the last entry of its journal, and continues from there.
    ///
    /// # Errors
    ///
    /// Returns an error that names the step at which the repetition differs.
    pub fn bring_back(back: BringBack) -> Result<Session, EpisodeError> {
        let BringBack { spec, folder, entries, clock, thinking, onlookers } = back;
        let hands = SetHands::default();
        let path = folder.as_ref().map(|folder| folder.path.clone()).unwrap_or_default();
        let mut session = Session::start_with_clock(&spec, folder, hands.clock(clock))?;
        session.set_onlookers(onlookers);
        session.catch_up();
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
        session.caught_up();
        hands.pass(thinking);
        hands.go();
        // The clock runs from this reading on.
        session.clock.thinking();
        session.keep_journal();
        Ok(session)
    }

    /// Leaves images and files to the recorder, since no caller waits for a reply.
    fn catch_up(&mut self) {
        self.observer.draw_for_recording(&self.origin.spec, &self.world);
        if let Some(files) = &mut self.files {
            files.catch_up(true);
        }
    }

    /// Ends [`Session::catch_up`].
    fn caught_up(&mut self) {
        self.observer.draw_at_once();
        if let Some(files) = &mut self.files {
            files.catch_up(false);
        }
    }
}

impl KeptRequest {
    /// Repeats the request. A refused request is refused again, so a refusal is no error.
    fn ask(self, session: &mut Session) -> Result<(), EpisodeError> {
        match self {
            KeptRequest::Call { operator, shown, tool, arguments } => {
                let caller = operator.as_deref().map_or(Caller::Policy, Caller::Operator);
                let audience = shown.as_deref().map_or(Audience::Caller, Audience::Process);
                let called = Called::parse(&tool, read(&arguments)?)?;
                let _ = session.perform(Request { caller, called, audience });
            }
            KeptRequest::Command { robot, tool, arguments } => {
                let call = Call::parse(&tool, read(&arguments)?)?;
                let _ = session.read_command(OperatorCall::new(&robot, call)?);
            }
            KeptRequest::Note { operator, note } => {
                let _ = session.note(operator.as_deref(), note);
            }
            KeptRequest::Refused { operator, tool, arguments, problem } => {
                session.refused_before(operator.as_deref(), &tool, &arguments, &problem);
            }
            KeptRequest::End { reason } => session.end(reason),
        }
        Ok(())
    }
}

/// Parses the arguments of a request.
fn read(arguments: &str) -> Result<Value, EpisodeError> {
    Ok(serde_json::from_str(arguments).map_err(OutputError::from)?)
}
