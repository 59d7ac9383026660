//! The wire contract: every tool that a policy can call, with its arguments, its reply and its JSON Schema.
//!
//! The doc comments of the argument types are the text that a language model reads, so they say units, frames and what
//! happens. Nothing here knows the simulator: [`ToolCall::parse`] checks what can be checked without looking at a world.
//!
//! To add a tool: one file in `tools/` and its line in `list.rs`. What does not answer it yet does not compile.

#![warn(missing_docs)]

mod asked;
mod checks;
mod error;
mod limits;
mod list;
mod parts;
mod refusal;
mod schema;
mod strict_value;
mod tool;
mod tools;

pub use asked::{Asked, Look, parse_start};
pub use error::SpecError;
pub use list::{
    ActCall, EPISODE_TOOLS, LookCall, LookReply, ManageCall, ManageReply, ToolCall, ToolReply, tool_specs,
};
pub use parts::{
    BASE_COLUMNS, BaseCommand, BaseLimits, BaseMotion, Budget, Bytes, CameraArrays, CommandReply,
    DepthFormat, Disclosure, Driving, Effort, FingerReport, Formats, HandReport, HandState, Heard, Hints,
    ImageFormat, JointValues, OperatorToken, Operators, Partner, PartnerDid, PhaseReached, PixelRegion, Png,
    Pose, Protocol, Range, RobotFallen, RobotReport, StopReason,
};
pub use refusal::{ProblemBody, Refusal, RefusalClass};
pub use schema::{EpisodeToolSpec, Format, ToolSpec};
pub use tool::{Route, Tool, parse_args};
pub use tools::*;

/// The REST interface of `version` as OpenAPI 3.1, from the same types that read and write it.
pub fn openapi(version: &str, hints: Hints) -> serde_json::Value {
    schema::openapi(version, &asked::specs_for_programs(hints))
}

/// The tools of the running episode `id`, whose commands may have up to `most_steps` control steps.
pub fn episode_tool_specs(hints: Hints, id: &str, most_steps: u32) -> Vec<EpisodeToolSpec> {
    let specs = asked::specs_for_programs(hints).into_iter().filter(|spec| spec.on_episode);
    specs.map(|spec| spec.of_episode(id, most_steps)).collect()
}

/// The tool `say` of the running episode `id`, which has it where its operators may talk.
pub fn say_spec(hints: Hints, id: &str) -> EpisodeToolSpec {
    say_tool(hints).of_episode(id, 0)
}

/// The tool `say` as hosts of language models need it.
pub fn say_tool(hints: Hints) -> ToolSpec {
    ToolSpec::on_episode::<Say>(hints)
}
