//! Notes of the player on its play, as recordings hold them.

use std::time::Duration;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use tandem_tools_spec::{AgentEnding, Note, NoteKind, TokenCount};

use super::messages::{CallMoment, JsonMessage};

/// A note on the episode. Unknown values are omitted.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct NoteMessage {
    pub text: String,
    /// `thought`, `message` or `note`.
    #[schemars(with = "String")]
    pub kind: NoteKind,
    /// Number of messages on `/tool_calls` before the note; the note belongs to the next one.
    pub calls_before: u32,
    /// Number of control steps before the note.
    pub control_step: u64,
    /// Thinking time of the policy before the note, since the episode began.
    pub thought_ns: u64,
    /// The robot that the note is about; absent if it is about all robots.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub robot: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub model: Option<String>,
    /// Tokens that the model read, including cached ones; absent, like the next two, if not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u32")]
    pub input_tokens: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u32")]
    pub output_tokens: Option<u32>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "u32")]
    pub cached_tokens: Option<u32>,
    /// Cost in US dollars.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub usd: Option<f64>,
    /// Duration of the model's computation in seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "f64")]
    pub seconds: Option<f64>,
    /// End of the model's play; absent if it continued.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(with = "String")]
    pub ending: Option<AgentEnding>,
}

impl JsonMessage for NoteMessage {
    const SCHEMA_NAME: &str = "tandem.Note";
}

impl NoteMessage {
    /// Creates the message of a note at this moment, when `/tool_calls` had `calls_before` messages.
    pub fn new(at: CallMoment, calls_before: u32, note: Note) -> NoteMessage {
        let Note { text, kind, robot, tokens, usd, model, seconds, ending } = note;
        let counted = |of: fn(&TokenCount) -> u32| tokens.as_ref().map(of);
        NoteMessage {
            text,
            kind: kind.unwrap_or(NoteKind::Note),
            calls_before,
            control_step: at.control_step,
            thought_ns: at.thought_ns(),
            robot,
            model,
            input_tokens: counted(|tokens| tokens.input),
            output_tokens: counted(|tokens| tokens.output),
            cached_tokens: counted(|tokens| tokens.cached),
            usd,
            seconds,
            ending,
        }
    }

    /// Returns the policy's thinking time before the note.
    pub fn thought(&self) -> Duration {
        Duration::from_nanos(self.thought_ns)
    }
}
