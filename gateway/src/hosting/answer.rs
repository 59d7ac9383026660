//! What a call on an episode is answered with.

use serde::Serialize;
use tandem_episodes::Session;
use tandem_tools_spec::{ManageReply, ToolReply};

/// A tool's reply, and what has to be said with every reply.
#[derive(Debug, Serialize)]
pub struct Answer {
    /// The reply.
    #[serde(flatten)]
    pub reply: ToolReply,
    /// Why the recording is not complete; left out where it is, and where the reply itself says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
}

impl Answer {
    /// The answer of `session` with `reply`.
    pub fn new(reply: ToolReply, session: &Session) -> Answer {
        let says_it = matches!(reply, ToolReply::Manage(ManageReply::Finish(_)));
        let failed = session.recording_failed().filter(|_| !says_it);
        Answer { reply, recording_failed: failed.map(str::to_owned) }
    }
}
