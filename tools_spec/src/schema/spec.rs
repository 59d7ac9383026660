//! Specifications of tools for hosts of language models.

use serde::Serialize;
use serde_json::{Map, Value, json};

use super::nullable::leave_out;
use super::plain::{body_schema, plain_schema};
use super::readable::{make_readable, refer_to_list};
use super::strict::{SHORT, SHORTLY, require_episode_id, require_short, strict_schema};
use crate::limits::{bound_robots, bound_steps};
use crate::parts::Wording;
use crate::tool::{Route, Tool};
use crate::tools::{Observe, SendPlan};

/// A tool as a policy's host needs it, for OpenAI, Anthropic and MCP.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ToolSpec {
    /// Name that callers use.
    pub name: &'static str,
    /// Description of the tool for the model.
    pub description: String,
    /// Strict JSON Schema of the arguments, with `episode_id` if the tool acts on an episode.
    pub input_schema: Map<String, Value>,
    /// The same schema with the defaults of optional fields.
    #[serde(skip)]
    with_defaults: Map<String, Value>,
    /// The schema of [`ToolSpec::body_schema`], in which fields that count control steps are only marked.
    #[serde(skip)]
    marked_body: Value,
    /// JSON Schema of the reply. Hosts of language models do not need it (MCP clients drop the images of a
    /// tool that declares one), so it is only part of the OpenAPI description.
    #[serde(skip)]
    pub reply_schema: Value,
    /// True if the call leaves the world unchanged.
    pub read_only: bool,
    /// True if a repeated call changes nothing further.
    #[serde(skip)]
    pub idempotent: bool,
    /// True if the tool acts on an episode that `start_episode` made.
    pub on_episode: bool,
    /// True if the tool is offered only to operators that may talk to each other.
    #[serde(skip)]
    pub for_operators: bool,
    /// True if the tool is offered only to policies with full assistance.
    #[serde(skip)]
    pub full_only: bool,
    /// True if the tool is not offered to language models.
    #[serde(skip)]
    pub for_programs: bool,
    /// True if its schema is strict.
    #[serde(skip)]
    pub strict: bool,
    /// REST route of the tool.
    pub route: Route,
}

/// A tool of a running episode, for a reader. Its route contains the episode's id, and its body schema
/// follows the episode's rules.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EpisodeToolSpec {
    /// Name that callers use.
    pub name: &'static str,
    /// Description of the tool for the model.
    pub description: String,
    /// True if the call leaves the world unchanged.
    pub read_only: bool,
    /// REST route of the tool.
    pub route: Route,
    /// JSON Schema of the body without texts that refusals contain.
    pub body_schema: Value,
}

impl ToolSpec {
    /// Returns the specification of `T`, which acts on an episode. Outside REST, where the path names the
    /// episode, the arguments contain `episode_id`. The tool may be limited to operators that talk.
    pub fn on_episode<T: Tool>(wording: Wording, for_operators: bool) -> ToolSpec {
        let mut spec = ToolSpec::without_episode::<T>(wording);
        if spec.input_schema["properties"].get(SHORT).is_none() {
            require_short(&mut spec.input_schema, false);
            require_short(&mut spec.with_defaults, true);
            spec.marked_body["properties"][SHORT] =
                json!({ "type": ["boolean", "null"], "description": SHORTLY, "default": false });
        }
        require_episode_id(&mut spec.input_schema);
        require_episode_id(&mut spec.with_defaults);
        ToolSpec { on_episode: true, for_operators, ..spec }
    }

    /// Returns the specification of `T`, which needs no episode.
    pub fn without_episode<T: Tool>(wording: Wording) -> ToolSpec {
        let (description, input_schema) = strict_schema::<T>(wording, false);
        ToolSpec {
            name: T::NAME,
            description,
            input_schema,
            with_defaults: strict_schema::<T>(wording, true).1,
            marked_body: body_schema::<T>(wording),
            reply_schema: plain_schema::<T::Reply>(),
            read_only: T::READ_ONLY,
            idempotent: T::IDEMPOTENT,
            on_episode: false,
            for_operators: false,
            full_only: T::FULL_ONLY,
            for_programs: T::FOR_PROGRAMS,
            strict: T::STRICT,
            route: T::route(),
        }
    }

    /// Allows additional fields in a body, each with its schema.
    pub(crate) fn allow(&mut self, fields: &Map<String, Value>) {
        if let Value::Object(properties) = &mut self.marked_body["properties"] {
            properties.extend(fields.clone());
        }
    }

    /// Requires a body to match one of these schemas as well.
    pub(crate) fn demand_one_of(&mut self, conditions: Value) {
        self.marked_body["anyOf"] = conditions;
    }

    /// Returns the schema of a plan's command that uses this tool. A command with `until` may have more
    /// steps.
    pub(crate) fn as_planned(&self) -> Value {
        let mut arguments = self.marked_body.clone();
        arguments.as_object_mut().and_then(|arguments| arguments.shift_remove("$schema"));
        let mut command = json!({ "properties": { "tool": { "const": self.name } } });
        if SendPlan::UNTIL_COMMANDS.contains(&self.name) {
            let steps = std::mem::replace(&mut arguments["properties"]["steps"], long_steps());
            let short = json!({ "arguments": { "properties": { "steps": steps } } });
            let until = json!({ "until": { "const": true } });
            command["anyOf"] =
                json!([{ "properties": short }, { "properties": until, "required": ["until"] }]);
        }
        command["properties"]["arguments"] = arguments;
        command
    }

    /// Requires the commands of a plan to match one of these schemas as well.
    pub(crate) fn demand_of_commands(&mut self, planned: Vec<Value>) {
        self.marked_body["properties"]["commands"]["items"]["anyOf"] = planned.into();
    }

    /// Returns the JSON Schema of a REST body, which need not be strict. Nullable fields are optional, and
    /// lengths are stated. A command may have up to `most_steps` control steps.
    pub fn body_schema(&self, most_steps: u32) -> Value {
        let mut schema = self.marked_body.clone();
        bound_steps(&mut schema, most_steps);
        schema
    }

    /// Returns the strict schema with one relaxation: nullable fields are optional and have their defaults.
    /// It is for hosts that check arguments against the schema but do not require strictness, for example MCP
    /// hosts.
    pub fn lenient_schema(&self) -> Map<String, Value> {
        leaving_out(&self.with_defaults, true)
    }

    /// Returns a strict schema for hosts that limit the numbers of optional and of nullable fields over all
    /// tools. The call's own fields may be null; fields of list entries may be omitted.
    pub fn few_unions_schema(&self) -> Map<String, Value> {
        leaving_out(&self.input_schema, false)
    }

    /// Returns the tool for the running episode `id`, for a caller that commands `robots`.
    pub fn of_episode(self, id: &str, robots: &[String], most_steps: u32) -> EpisodeToolSpec {
        let mut body_schema = self.body_schema(most_steps);
        bound_robots(&mut body_schema, robots);
        make_readable(&mut body_schema);
        if let Value::Object(body) = &mut body_schema {
            // This is the description of the tool.
            body.remove("description");
        }
        if let Some(properties) = body_schema["properties"].as_object_mut() {
            refer_to_list(properties, Observe::NAME);
        }
        EpisodeToolSpec {
            name: self.name,
            description: self.description,
            read_only: self.read_only,
            route: Route::of_episode(id, self.name),
            body_schema,
        }
    }
}

/// Returns the schema of `steps` of a command with `until`.
fn long_steps() -> Value {
    json!({ "type": "integer", "minimum": 1, "maximum": SendPlan::MAX_UNTIL_STEPS })
}

fn leaving_out(schema: &Map<String, Value>, own_fields: bool) -> Map<String, Value> {
    let mut schema = Value::Object(schema.clone());
    leave_out(&mut schema, own_fields);
    if let (true, Value::Array(required)) = (own_fields, &mut schema["required"]) {
        required.retain(|name| name != SHORT);
    }
    schema.as_object_mut().map(std::mem::take).unwrap_or_default()
}
