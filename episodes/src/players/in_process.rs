//! An episode in this process, in the form that players use.

use tandem_tools_spec::{ExtraInformation, Observe, Tool as _, ToolCall, ToolReply};

use super::{Episode, LocalEpisode, PlayerError, PrivilegedEpisode};
use crate::observation::{Picture, TeamObservation};
use crate::scoring::Facts;
use crate::{EpisodeError, Session};

/// An episode in this process.
pub struct InProcess {
    pub session: Session,
    /// Number of phases after which the episode is over for the player, even if the session goes on.
    until: usize,
}

impl InProcess {
    /// Creates an episode that is played to its end.
    pub fn new(session: Session) -> InProcess {
        InProcess { session, until: usize::MAX }
    }

    /// Creates an episode that is played until `phases` phases have been reached.
    pub fn until(phases: usize, session: Session) -> InProcess {
        InProcess { session, until: phases }
    }

    fn check_underway(&self) -> Result<(), PlayerError> {
        match self.session.reached_phases() >= self.until {
            true => Err(PlayerError::EpisodeOver),
            false => Ok(()),
        }
    }
}

impl Episode for InProcess {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.check_underway()?;
        let tool = call.name();
        self.session.call(call).map_err(|error| refused(tool, error))
    }
}

fn refused(tool: &'static str, error: EpisodeError) -> PlayerError {
    match error {
        EpisodeError::Ended { .. } => PlayerError::EpisodeOver,
        error => PlayerError::Call { tool, reason: error.to_string() },
    }
}

impl LocalEpisode for InProcess {
    fn observe(
        &mut self,
        observe: &Observe,
        shown: &[ExtraInformation],
    ) -> Result<TeamObservation, PlayerError> {
        self.check_underway()?;
        self.session.observe(observe, shown).map_err(|error| refused(Observe::NAME, error))
    }

    fn carry_out(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        self.check_underway()?;
        let tool = call.name();
        self.session.carry_out(call).map_err(|error| refused(tool, error))
    }

    fn third_person(&mut self) -> Result<Picture, PlayerError> {
        Ok(self.session.third_person())
    }
}

impl PrivilegedEpisode for InProcess {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}
