//! Specifications of tools in the very form that the official SDKs of model hosts take.

use serde_json::{Value, json};

use super::spec::ToolSpec;
use super::strict::SHORT;

/// Host whose form a specification has.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Format {
    /// OpenAI's Responses API, strict.
    OpenAi,
    /// OpenAI's Chat Completions API, strict.
    OpenAiChat,
    /// Anthropic's Messages API, strict.
    Anthropic,
    /// `tools/list` of the Model Context Protocol.
    Mcp,
}

impl Format {
    /// Every form.
    pub const ALL: [Format; 4] = [Format::OpenAi, Format::OpenAiChat, Format::Anthropic, Format::Mcp];

    /// Returns the name that callers use.
    pub fn name(self) -> &'static str {
        match self {
            Format::OpenAi => "openai",
            Format::OpenAiChat => "openai-chat",
            Format::Anthropic => "anthropic",
            Format::Mcp => "mcp",
        }
    }

    /// Returns the form called `name`.
    pub fn find(name: &str) -> Option<Format> {
        Format::ALL.into_iter().find(|format| format.name() == name)
    }
}

impl ToolSpec {
    /// Returns the tool in the form of `format`.
    pub fn formatted(&self, format: Format) -> Value {
        match format {
            Format::OpenAi => {
                let mut tool = self.function();
                tool["type"] = "function".into();
                tool
            }
            Format::OpenAiChat => json!({ "type": "function", "function": self.function() }),
            Format::Anthropic => json!({
                "name": self.name,
                "description": self.description,
                "input_schema": if self.strict { self.few_unions_schema() } else { self.lenient_schema() },
                "strict": self.strict,
            }),
            Format::Mcp => self.of_mcp(),
        }
    }

    fn function(&self) -> Value {
        json!({
            "name": self.name,
            "description": self.description,
            "parameters": if self.strict { self.input_schema.clone() } else { self.lenient_schema() },
            "strict": self.strict,
        })
    }

    /// Returns the tool for MCP. A host that leaves `short` out gets the short reply, which the server's
    /// instructions say once. Has no output schema, since clients drop the pictures of tools that declare
    /// one, and only the annotations that are not MCP's defaults: a list of tools is read by a model in
    /// every conversation.
    fn of_mcp(&self) -> Value {
        let mut schema = Value::Object(self.lenient_schema());
        slim(&mut schema);
        if let Some(short) = schema.get_mut("properties").and_then(|properties| properties.get_mut(SHORT)) {
            *short = json!({ "type": "boolean" });
        }
        let annotations = match (self.read_only, self.idempotent) {
            (true, _) => json!({ "readOnlyHint": true }),
            (false, true) => json!({ "destructiveHint": false, "idempotentHint": true }),
            (false, false) => json!({ "destructiveHint": false }),
        };
        json!({
            "name": self.name,
            "description": self.description,
            "inputSchema": schema,
            "annotations": annotations,
        })
    }
}

/// Required fields whose names say what they are.
const PLAIN_NAMES: [&str; 3] = ["episode_id", "robot", "robots"];

/// Drops what names say and what the server checks by itself: defaults, and that no other fields are known.
fn slim(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(slim),
        Value::Object(object) => {
            object.remove("default");
            if object.get("additionalProperties").is_some_and(Value::is_boolean) {
                object.remove("additionalProperties");
            }
            if object.get("required").and_then(Value::as_array).is_some_and(Vec::is_empty) {
                object.remove("required");
            }
            let required = object.get("required").cloned().unwrap_or_default();
            let is_plain = |name: &str| {
                PLAIN_NAMES.contains(&name)
                    && required.as_array().is_some_and(|all| all.contains(&name.into()))
            };
            if let Some(Value::Object(properties)) = object.get_mut("properties") {
                let plain = properties.iter_mut().filter(|(name, _)| is_plain(name));
                plain.filter_map(|(_, property)| property.as_object_mut()).for_each(|property| {
                    property.remove("description");
                });
            }
            object.values_mut().for_each(slim);
        }
        _ => {}
    }
}
