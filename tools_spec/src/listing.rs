//! The episodes that a server holds, as it lists them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::parts::{Operators, Protocol};
use crate::tools::EndReason;

/// The episodes that the caller may know of, by id: for who started them all that the server holds, for the
/// operator of a robot its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EpisodeList {
    /// The episodes.
    pub episodes: Vec<EpisodeEntry>,
}

/// One episode, as its last call has left it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EpisodeEntry {
    /// The handle that every tool needs.
    pub episode_id: String,
    /// The task's id.
    pub task: String,
    /// The seed; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// The rules in force.
    pub protocol: Protocol,
    /// True where each robot has an operator of its own.
    pub operators: Operators,
    /// Control steps executed up to now, the initial hold included.
    pub step: u32,
    /// Why the episode has ended; null while it goes on.
    pub ended: Option<EndReason>,
}
