//! The contract as machines read it: strict JSON Schema for the hosts of language models, OpenAPI for
//! everybody else.

mod format;
mod nullable;
mod openapi;
mod plain;
mod readable;
mod spec;
mod strict;
mod typed;

pub use format::Format;
pub use openapi::openapi;
pub use plain::{body_schema, plain_schema};
pub use spec::{EpisodeToolSpec, ToolSpec};
pub use typed::{TypedTool, TypedTools, TypedToolsCollector};
