//! What can be wrong with a call before any world is asked, and the body every refusal is served with.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A call that does not fit the contract. The text says what would work, because its reader is often a language model.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SpecError {
    /// The name is not one of the tools that act on an episode.
    #[error("no tool {name:?}; have: {}", .have.join(", "))]
    UnknownTool {
        /// The name that was asked for.
        name: String,
        /// Every name that would have worked.
        have: Vec<&'static str>,
    },
    /// The arguments do not have the tool's fields and types.
    #[error("{tool}: {place}{reason}; arguments that work: {example}")]
    Malformed {
        /// The tool that was called.
        tool: &'static str,
        /// Where in the arguments, as `robots[0].steps: `, or empty for the whole.
        place: String,
        /// What does not fit there.
        reason: String,
        /// One complete set of arguments, as JSON.
        example: String,
    },
    /// The arguments have the right shape but a value that can never work.
    #[error("{tool}: {reason}")]
    Invalid {
        /// The tool that was called.
        tool: &'static str,
        /// What is wrong, where, and what would work.
        reason: String,
    },
}

/// The body of every refusal: RFC 9457 problem details, served as `application/problem+json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ProblemBody {
    /// A stable name for the kind of problem, as `urn:tandem:problem:unknown-robot`.
    #[serde(rename = "type")]
    pub kind: String,
    /// The kind in words; the same for all problems of one kind.
    pub title: String,
    /// The HTTP status.
    pub status: u16,
    /// What was wrong with this call and what would work.
    pub detail: String,
    /// Why the recording of the episode is not complete; left out where it is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub recording_failed: Option<String>,
}
