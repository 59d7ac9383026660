//! Specifications of tools in the very form that the official SDKs of model hosts take.

use serde_json::{Value, json};

use super::spec::ToolSpec;

/// Whose form.
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

    /// The name that callers use.
    pub fn name(self) -> &'static str {
        match self {
            Format::OpenAi => "openai",
            Format::OpenAiChat => "openai-chat",
            Format::Anthropic => "anthropic",
            Format::Mcp => "mcp",
        }
    }

    /// The form called `name`.
    pub fn find(name: &str) -> Option<Format> {
        Format::ALL.into_iter().find(|format| format.name() == name)
    }
}

impl ToolSpec {
    /// The tool in the form of `format`.
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

    /// No output schema: clients drop the pictures of tools that declare one.
    fn of_mcp(&self) -> Value {
        json!({
            "name": self.name,
            "title": self.title(),
            "description": self.description,
            "inputSchema": self.lenient_schema(),
            "annotations": {
                "title": self.title(),
                "readOnlyHint": self.read_only,
                "destructiveHint": false,
                "idempotentHint": self.idempotent,
                "openWorldHint": false,
            },
        })
    }

    /// The name as people write it: `move_wrists` is "Move wrists".
    fn title(&self) -> String {
        let words = self.name.replace('_', " ");
        let (first, rest) = words.split_at(words.len().min(1));
        first.to_uppercase() + rest
    }
}
