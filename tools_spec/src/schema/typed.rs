//! Tools with named types of arguments and replies, for clients in languages that have a class for each type.

use schemars::{JsonSchema, SchemaGenerator, generate::SchemaSettings};
use serde_json::{Map, Value};

use super::plain::word;
use crate::parts::{Assistance, Wording};
use crate::tool::Tool;

/// All tools, and the types of their arguments and replies.
#[derive(Debug, Clone)]
pub struct TypedTools {
    /// Tools in the order in which policies see them.
    pub tools: Vec<TypedTool>,
    /// JSON Schema of each type by its name, which `#/$defs/NAME` refers to.
    pub types: Map<String, Value>,
}

/// One tool.
#[derive(Debug, Clone)]
pub struct TypedTool {
    /// Name that callers use.
    pub name: &'static str,
    /// JSON Schema of the arguments. Its description is the tool's description.
    pub arguments: Value,
    /// The name of the reply's type.
    pub reply: String,
    /// True if the tool acts on an episode.
    pub on_episode: bool,
    /// True if the tool is offered only to operators that may talk to each other.
    pub for_operators: bool,
}

/// Collects tools and the types that they use.
pub struct TypedToolsCollector {
    generator: SchemaGenerator,
    tools: Vec<TypedTool>,
}

impl TypedToolsCollector {
    pub fn new() -> TypedToolsCollector {
        TypedToolsCollector { generator: SchemaSettings::draft2020_12().into_generator(), tools: Vec::new() }
    }

    pub fn add<T: Tool>(&mut self, on_episode: bool, for_operators: bool) {
        let arguments = T::json_schema(&mut self.generator).to_value();
        self.generator.subschema_for::<T::Reply>();
        let reply = T::Reply::schema_name().into_owned();
        self.tools.push(TypedTool { name: T::NAME, arguments, reply, on_episode, for_operators });
    }

    /// Adds a named schema for a type inside a reply.
    pub fn add_type<T: JsonSchema>(&mut self) {
        self.generator.subschema_for::<T>();
    }

    /// Returns the collected tools and types, with the texts for full assistance.
    pub fn finish(mut self) -> TypedTools {
        let mut types = self.generator.take_definitions(true);
        let described = types.values_mut().chain(self.tools.iter_mut().map(|tool| &mut tool.arguments));
        described.for_each(|schema| word(schema, Wording::from(Assistance::Full)));
        TypedTools { tools: self.tools, types }
    }
}
