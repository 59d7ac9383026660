//! Specifications of tools in the formats that the official SDKs of model hosts accept.

use serde_json::{Map, Value, json};

use super::spec::ToolSpec;
use super::strict::SHORT;
use crate::tool::Tool as _;
use crate::tools::{Finish, Observe};

/// Host format of a specification.
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
    /// All formats.
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

    /// Returns the format called `name`.
    pub fn find(name: &str) -> Option<Format> {
        Format::ALL.into_iter().find(|format| format.name() == name)
    }
}

impl ToolSpec {
    /// Returns the tool in the format `format`.
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

    /// Returns the tool for MCP. If a host omits `short`, the reply is short, as the server's instructions
    /// state. The tool has no output schema, because clients drop the images of tools that declare one. It
    /// only has annotations that differ from MCP's defaults, because a model reads the list of tools in every
    /// conversation.
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

impl ToolSpec {
    /// Returns true if MCP clients may get the reply as structured content. Clients drop the images of a tool
    /// that declares structured content.
    pub fn has_structure(&self) -> bool {
        self.name != Observe::NAME
    }

    /// Returns the tool, with an outline of its reply, for MCP clients that request structured content.
    pub fn structured(&self) -> Value {
        let mut tool = self.of_mcp();
        if self.has_structure() {
            tool["outputSchema"] = match self.name {
                // An operator that leaves before the others gets a status instead of the result.
                Finish::NAME => json!({ "type": "object" }),
                _ => outline(&self.reply_schema),
            };
        }
        tool
    }
}

/// Returns the schema of an object with only the types of its own fields.
fn outline(schema: &Value) -> Value {
    let kind = |of: &Value| match &of["type"] {
        Value::Null => json!({}),
        kind => json!({ "type": kind }),
    };
    let properties = schema["properties"].as_object().into_iter().flatten();
    let properties: Map<String, Value> = properties.map(|(name, of)| (name.clone(), kind(of))).collect();
    json!({ "type": "object", "properties": properties, "required": schema["required"] })
}

/// Required fields with self-explanatory names.
const PLAIN_NAMES: [&str; 3] = ["episode_id", "robot", "robots"];
/// Fields whose names are self-explanatory, given the texts on the left hand and on the pelvis frame.
const PLAIN_EVERYWHERE: [&str; 4] = ["right_position_m", "right_quaternion_wxyz", "vx_m_s", "yaw_rate_rad_s"];

/// Removes parts that names already express or that the server checks: defaults, and the exclusion of other
/// fields.
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
                let is_required = required.as_array().is_some_and(|all| all.contains(&name.into()));
                PLAIN_EVERYWHERE.contains(&name) || PLAIN_NAMES.contains(&name) && is_required
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
