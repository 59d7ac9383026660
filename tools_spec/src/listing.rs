//! The episodes of a server, as it lists them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::parts::{Operators, Protocol};
use crate::tools::EndReason;

/// The episodes that the caller may see, by id: all of the server's, or for the operator of a robot its own.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EpisodeList {
    /// The episodes.
    pub episodes: Vec<EpisodeEntry>,
}

/// One episode after its last call.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EpisodeEntry {
    /// Handle that every tool needs.
    pub episode_id: String,
    /// The task's id.
    pub task: String,
    /// The seed; left out where the assistance is "paper".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u32>,
    /// The rules in force.
    pub protocol: Protocol,
    /// One operator for all robots, or one each.
    pub operators: Operators,
    /// Control steps executed up to now, the initial hold included.
    pub step: u32,
    /// Cause of the end; null while the episode runs.
    pub ended: Option<EndReason>,
}
