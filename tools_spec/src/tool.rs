//! The trait of tools, and how their arguments are read from JSON.

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

/// The arguments of one tool. The type's doc comment is the tool's description; hints on grasping are
/// separate from it, for policies with full assistance.
pub trait Tool: Serialize + DeserializeOwned + JsonSchema {
    /// Type of its reply.
    type Reply: Serialize + DeserializeOwned + JsonSchema;
    /// The name a caller uses.
    const NAME: &'static str;
    /// True if the call leaves the world exactly as it was and costs no steps.
    const READ_ONLY: bool;
    /// True if calling it again with the same arguments changes nothing more.
    const IDEMPOTENT: bool = Self::READ_ONLY;

    /// True if its schema can be strict: it names every field, and allows no others.
    const STRICT: bool = true;
    /// True if only policies with full assistance are offered it.
    const FULL_ONLY: bool = false;
    /// True if it is for programs: language models are not offered it.
    const FOR_PROGRAMS: bool = false;

    /// Returns valid arguments, shown to callers after a refusal.
    fn example() -> Self;

    /// Returns the robots that the arguments name, each as often as they name it.
    fn robots(&self) -> Vec<&str> {
        Vec::new()
    }

    /// Returns control steps of 20 ms that the call asks for; only commands ask for any.
    fn steps(&self) -> u32 {
        0
    }

    /// Returns its REST route.
    fn route() -> Route {
        Route::of_episode("{episode_id}", Self::NAME)
    }

    /// Checks properties that need no world: lengths, finite numbers, quaternions that have a direction. The
    /// text says which values would work.
    fn validate(&self) -> Result<(), String> {
        Ok(())
    }
}

/// Reads and checks the arguments of `T`, which have to be an object.
pub fn parse_args<T: Tool>(args: Value) -> Result<T, SpecError> {
    let parsed: T = read_as(T::NAME, args, || json!(T::example()))?;
    parsed.validate().map_err(|reason| SpecError::Invalid { tool: T::NAME, reason })?;
    Ok(parsed)
}

/// Parses a value that refusals call `name`; `example` is a valid one.
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

/// Removes the fields that are null. Nullable fields are optional, and not every form of the contract has
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

/// Replaces the names of Rust's types in an error of serde by plain words.
fn in_plain_words(reason: &str) -> String {
    reason.replace("expected u32", "expected a whole number from 0 to 4294967295")
}
