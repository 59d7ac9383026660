//! One tool: its name, the text a model reads, and how its arguments are read from JSON.

use schemars::JsonSchema;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use crate::{SpecError, schema};

/// The arguments of one tool. The type's doc comment is the tool's description.
pub trait Tool: Serialize + DeserializeOwned + JsonSchema {
    /// What the tool answers.
    type Reply: Serialize + DeserializeOwned + JsonSchema;
    /// The name a caller uses.
    const NAME: &'static str;
    /// Whether the call leaves the world exactly as it was and costs no steps.
    const READ_ONLY: bool;

    /// Arguments that work, shown to callers whose own did not.
    fn example() -> Self;

    /// Checks what needs no world: lengths, finite numbers, quaternions that have a direction. The text says what
    /// would work.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// Reads and checks the arguments of `T`. `null` stands for no arguments.
pub fn parse_args<T: Tool>(args: Value) -> Result<T, SpecError> {
    let args = if args.is_null() { json!({}) } else { args };
    let parsed: T = serde_path_to_error::deserialize(args).map_err(|error| {
        let path = error.path().to_string();
        SpecError::Malformed {
            tool: T::NAME,
            place: if path == "." { String::new() } else { format!("{path}: ") },
            reason: in_plain_words(&error.into_inner().to_string()),
            example: json!(T::example()).to_string(),
        }
    })?;
    parsed.validate().map_err(|reason| SpecError::Invalid { tool: T::NAME, reason })?;
    Ok(parsed)
}

/// Serde names Rust's types, which a caller need not know.
fn in_plain_words(reason: &str) -> String {
    reason.replace("expected u32", "expected a whole number from 0 to 4294967295")
}

/// A tool as a policy's host needs it: for OpenAI, Anthropic and MCP alike.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolSpec {
    /// The name a caller uses.
    pub name: &'static str,
    /// What the tool does, for the model.
    pub description: String,
    /// Strict JSON Schema of the arguments, with `episode_id` where the tool acts on an episode.
    pub input_schema: Value,
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
        schema::require_episode_id(&mut spec.input_schema);
        ToolSpec { on_episode: true, ..spec }
    }

    /// The specification of `T`, which needs no episode.
    pub fn without_episode<T: Tool>() -> ToolSpec {
        let (description, input_schema) = schema::strict_schema::<T>();
        ToolSpec {
            name: T::NAME,
            description,
            input_schema,
            body_schema: schema::plain_schema::<T>(),
            reply_schema: schema::plain_schema::<T::Reply>(),
            read_only: T::READ_ONLY,
            on_episode: false,
        }
    }
}
