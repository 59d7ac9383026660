//! The trait of tools, and parsing of their arguments from JSON.

use schemars::JsonSchema;
use serde::{Serialize, de::DeserializeOwned};
use serde_json::{Value, json};

use crate::error::SpecError;
use crate::strict_value::StrictValue;

/// REST route of a tool.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Route {
    /// HTTP method, for example `POST`.
    pub method: &'static str,
    /// Path, for example `/v1/episodes/{episode_id}/tools/wait`.
    pub path: String,
}

impl Route {
    /// Returns the route of a tool that acts on the episode `id`.
    pub fn of_episode(id: &str, tool: &str) -> Route {
        Route { method: "POST", path: format!("/v1/episodes/{id}/tools/{tool}") }
    }
}

/// The arguments of one tool. The type's doc comment is the tool's description. Hints on grasping are
/// separate, for policies with full assistance.
pub trait Tool: Serialize + DeserializeOwned + JsonSchema {
    /// Type of the reply.
    type Reply: Serialize + DeserializeOwned + JsonSchema;
    /// Name that callers use.
    const NAME: &'static str;
    /// True if the call leaves the world exactly unchanged and costs no steps.
    const READ_ONLY: bool;
    /// True if a repeated call with the same arguments changes nothing further.
    const IDEMPOTENT: bool = Self::READ_ONLY;

    /// True if the schema can be strict: it names every field, and allows no others.
    const STRICT: bool = true;
    /// True if the tool is offered only to policies with full assistance.
    const FULL_ONLY: bool = false;
    /// True if the tool is for programs and is not offered to language models.
    const FOR_PROGRAMS: bool = false;

    /// Returns valid arguments, which callers see after a refusal.
    fn example() -> Self;

    /// Returns the robots that the arguments name, including repetitions.
    fn robots(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Returns the number of requested control steps of 20 ms; 0 if the tool is not a command.
    fn steps(&self) -> u32 {
        0
    }

    /// Returns the REST route of the tool.
    fn route() -> Route {
        Route::of_episode("{episode_id}", Self::NAME)
    }

    /// Checks properties that need no world: lengths, finite numbers, and directions of quaternions. Errors
    /// state valid values.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// Parses and checks the arguments of `T`, which must be an object.
pub fn parse_args<T: Tool>(args: Value) -> Result<T, SpecError> {
    let parsed: T = read_as(T::NAME, args, || json!(T::example()))?;
    parsed.validate().map_err(|reason| SpecError::Invalid { tool: T::NAME, reason })?;
    Ok(parsed)
}

/// Parses a value that refusals call `name`. `example` returns a valid value.
pub fn read_as<T: DeserializeOwned>(
    name: &'static str,
    value: Value,
    example: impl FnOnce() -> Value,
) -> Result<T, SpecError> {
    serde_path_to_error::deserialize(StrictValue(value)).map_err(|error| {
        let path = error.path().to_string();
        SpecError::Malformed {
            tool: name,
            place: if path == "." { String::new() } else { format!("{path}: ") },
            reason: in_plain_words(&error.into_inner().to_string()),
            example: without_nulls(example()).to_string(),
        }
    })
}

/// Removes the fields that are null. Nullable fields are optional, and some forms of the contract have no
/// null.
fn without_nulls(value: Value) -> Value {
    match value {
        Value::Array(items) => items.into_iter().map(without_nulls).collect(),
        Value::Object(fields) => {
            let given = fields.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(given.map(|(name, value)| (name, without_nulls(value))).collect())
        }
        scalar => scalar,
    }
}

/// Replaces the names of Rust types in a serde error by plain words.
fn in_plain_words(reason: &str) -> String {
    reason.replace("expected u32", "expected a whole number from 0 to 4294967295")
}
