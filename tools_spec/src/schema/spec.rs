//! Tools as the hosts of language models need them.

use serde::Serialize;
use serde_json::{Map, Value};

use super::plain::{body_schema, plain_schema};
use super::strict::{require_episode_id, strict_schema};
use crate::tool::Tool;

/// A tool as a policy's host needs it: for OpenAI, Anthropic and MCP alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolSpec {
    /// The name a caller uses.
    pub name: &'static str,
    /// What the tool does, for the model.
    pub description: String,
    /// Strict JSON Schema of the arguments, with `episode_id` where the tool acts on an episode.
    pub input_schema: Map<String, Value>,
    /// JSON Schema of a REST body, which need not be strict: what may be null may be left out, and lengths are said.
    #[serde(skip)]
    pub body_schema: Value,
    /// JSON Schema of the reply. Hosts of language models do not want it (MCP clients drop the pictures of a tool that
    /// declares one), so it is only part of the OpenAPI description.
    #[serde(skip)]
    pub reply_schema: Value,
    /// Whether the call leaves the world as it was.
    pub read_only: bool,
    /// Whether the tool acts on an episode that `start_episode` made.
    pub on_episode: bool,
}

impl ToolSpec {
    /// The specification of `T`, which acts on an episode; without a path to name it, the arguments carry `episode_id`.
    pub fn on_episode<T: Tool>() -> ToolSpec {
        let mut spec = ToolSpec::without_episode::<T>();
        require_episode_id(&mut spec.input_schema);
        ToolSpec { on_episode: true, ..spec }
    }

    /// The specification of `T`, which needs no episode.
    pub fn without_episode<T: Tool>() -> ToolSpec {
        let (description, input_schema) = strict_schema::<T>();
        ToolSpec {
            name: T::NAME,
            description,
            input_schema,
            body_schema: body_schema::<T>(),
            reply_schema: plain_schema::<T::Reply>(),
            read_only: T::READ_ONLY,
            on_episode: false,
        }
    }
}
