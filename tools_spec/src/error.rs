//! Errors of a call that are detected without a world.

use serde_json::Value;

use crate::refusal::{Refusal, RefusalClass};

/// A call that violates the contract. The text states a valid call, because its reader is often a language
/// model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// No tool that acts on an episode has this name.
    #[error("no tool {name:?}; have: {}", .have.join(", "))]
    UnknownTool {
        /// The requested name.
        name: String,
        /// All valid names.
        have: Vec<&'static str>,
    },
    /// The arguments do not match the tool's fields and types.
    #[error("{tool}: {place}{reason}; arguments that work: {example}")]
    Malformed {
        /// The tool that was called.
        tool: &'static str,
        /// Place in the arguments, for example `robots[0].steps: `; empty for the arguments as a whole.
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
        /// The mistake, its place, and a valid call.
        reason: String,
    },
}

impl SpecError {
    /// Returns the error for a caller that names the episode among the arguments. The example then also
    /// contains the episode.
    pub fn naming_episode(mut self, id: &str) -> SpecError {
        if let SpecError::Malformed { example, .. } = &mut self
            && let Ok(Value::Object(arguments)) = serde_json::from_str(example)
        {
            let named = std::iter::once(("episode_id".into(), id.into())).chain(arguments);
            *example = Value::Object(named.collect()).to_string();
        }
        self
    }

    /// Returns the refusal for the caller.
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
