//! An episode in this process, as a player meets it.

use tandem_tools_spec::{ToolCall, ToolReply};

use super::{Backstage, Caller, PlayerError};
use crate::scoring::Facts;
use crate::{EpisodeError, Session};

/// An episode in this process.
pub struct InProcess(pub Session);

impl Caller for InProcess {
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, PlayerError> {
        let tool = call.name();
        self.0.call(call).map_err(|error| match error {
            EpisodeError::Ended { .. } => PlayerError::EpisodeOver,
            error => PlayerError::Call { tool, reason: error.to_string() },
        })
    }
}

impl Backstage for InProcess {
    fn facts(&mut self) -> Result<Facts, PlayerError> {
        Ok(self.0.facts())
    }
}
