//! An episode in this process, as a player meets it.

use tandem_tools_spec::{Png, ToolCall, ToolReply};

use super::{Episode, PlayerError, PrivilegedEpisode, ThirdPersonEpisode};
use crate::scoring::Facts;
use crate::{EpisodeError, Session};

/// An episode in this process.
pub struct InProcess {
    pub session: Session,
    /// Number of phases after which it is over for the player, whatever is left of it.
    until: usize,
}

impl InProcess {
    /// An episode that is played to its end.
    pub fn new(session: Session) -> InProcess {
        InProcess { session, until: usize::MAX }
    }

    /// An episode that is played until `phases` phases have been reached.
    pub fn until(phases: usize, session: Session) -> InProcess {
        InProcess { session, until: phases }
    }
}

impl Episode for InProcess {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        if self.session.reached_phases() >= self.until {
            return Err(PlayerError::EpisodeOver);
        }
        let tool = call.name();
        self.session.call(call).map_err(|error| match error {
            EpisodeError::Ended { .. } => PlayerError::EpisodeOver,
            error => PlayerError::Call { tool, reason: error.to_string() },
        })
    }
}

impl ThirdPersonEpisode for InProcess {
    fn third_person(&mut self) -> Result<Png, PlayerError> {
        let seen = self.session.third_person();
        seen.map_err(|error| PlayerError::Call { tool: "third_person", reason: error.to_string() })
    }
}

impl PrivilegedEpisode for InProcess {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.session.facts())
    }
}
