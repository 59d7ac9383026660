//! Errors of a call that are found without a world.

use serde_json::Value;

use crate::refusal::{Refusal, RefusalClass};

/// A call that does not fit the contract. The text says which call would work, because its reader is often a
/// language model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// The name is not one of the tools that act on an episode.
    #[error("no tool {name:?}; have: {}", .have.join(", "))]
    UnknownTool {
        /// The requested name.
        name: String,
        /// All valid names.
        have: Vec<&'static str>,
    },
    /// The arguments do not have the tool's fields and types.
    #[error("{tool}: {place}{reason}; arguments that work: {example}")]
    Malformed {
        /// The tool that was called.
        tool: &'static str,
        /// Place in the arguments, for example `robots[0].steps: `; empty for the whole.
        place: String,
        /// Mismatch at that place.
        reason: String,
        /// One complete set of arguments, as JSON.
        example: String,
    },
    /// The arguments have the right shape but a value that can never work.
    #[error("{tool}: {reason}")]
    Invalid {
        /// The tool that was called.
        tool: &'static str,
        /// Mistake, its place, and a correct call.
        reason: String,
    },
}

impl SpecError {
    /// Returns the error for a caller that names the episode among the arguments. Its example then does so,
    /// too.
    pub fn naming_episode(mut self, id: &str) -> SpecError {
        if let SpecError::Malformed { example, .. } = &mut self
            && let Ok(Value::Object(arguments)) = serde_json::from_str(example)
        {
            let named = std::iter::once(("episode_id".into(), id.into())).chain(arguments);
            *example = Value::Object(named.collect()).to_string();
        }
        self
    }

    /// Returns the refusal that the caller reads.
    pub const fn refusal(&self) -> Refusal {
        match self {
            SpecError::UnknownTool { .. } => {
                Refusal::new("unknown-tool", "Unknown tool", RefusalClass::NotFound)
            }
            SpecError::Malformed { .. } | SpecError::Invalid { .. } => {
                Refusal::new("invalid-arguments", "Invalid arguments", RefusalClass::Invalid)
            }
        }
    }
}
