//! The wire contract: every tool that a policy can call, with its arguments, its reply and its JSON Schema.
//!
//! The doc comments of the argument types are texts that a language model reads, so they state units, frames
//! and effects. The crate does not depend on the simulator: [`Call::parse`] performs only checks that need no
//! world.
//!
//! To add a tool, add one file in `tools/` and its line in `list.rs`. Code that does not handle the tool yet
//! fails to compile.

#![warn(missing_docs)]

mod call;
mod checks;
mod error;
mod limits;
mod list;
mod listing;
mod parts;
mod refusal;
mod schema;
mod strict_value;
mod tool;
mod tools;

pub use call::{Call, Look, PlanStep, PlannedCall, parse_start};
pub use error::SpecError;
pub use list::{
    ActCall, EPISODE_TOOLS, LookCall, LookReply, ManageCall, ManageReply, PlanCall, TalkCall, TalkReply,
    ToolCall, ToolReply, operator_tool_specs, tool_specs, typed_tools,
};
pub use listing::{EpisodeEntry, EpisodeList};
pub use parts::{
    AgentEnding, Assistance, BASE_COLUMNS, BaseCommand, BaseLimits, BaseMotion, BaseReport, BaseState,
    Budget, Bytes, CameraArrays, CommandReply, DepthFormat, Disclosure, Driving, Effort, ExtraInformation,
    FingerReport, Formats, Grip, HandPart, HandReport, HandState, Heard, HeldObject, Hints, ImageFormat,
    JointValues, ModelEnding, NextPhase, Note, NoteKind, OperatorToken, OperatorUse, Operators, Partner,
    PartnerDid, PhaseReached, PixelRegion, PlanReply, Png, Pose, PoseFrame, Presence, PresenceState,
    Protocol, Range, RobotFallen, RobotReport, RobotUsage, StopReason, TokenCount, Touch, Usage, Wording,
};
pub use refusal::{ProblemBody, Refusal, RefusalClass};
pub use schema::{EpisodeToolSpec, Format, ToolSpec, TypedTool, TypedTools};
pub use tool::{Route, Tool, parse_args};
pub use tools::*;

/// Returns the REST interface of `version` as OpenAPI 3.1, generated from the types that read and write it.
/// `talk` is true for a caller that may talk.
pub fn openapi(version: &str, wording: impl Into<Wording>, talk: bool) -> serde_json::Value {
    let wording = wording.into();
    let specs: Vec<ToolSpec> = call::specs_for_programs(wording)
        .into_iter()
        .filter(|spec| talk || !spec.for_operators)
        .filter(|spec| !spec.full_only || wording.assistance == Assistance::Full)
        .collect();
    schema::openapi(version, &specs)
}

/// Returns the tools of the running episode `id` with these `robots`. Commands may have up to `most_steps`
/// control steps. `talk` is true for a caller that may talk.
pub fn episode_tool_specs(
    wording: impl Into<Wording>,
    id: &str,
    robots: &[String],
    most_steps: u32,
    talk: bool,
) -> Vec<EpisodeToolSpec> {
    let wording = wording.into();
    let specs = call::specs_for_programs(wording).into_iter();
    let told = |spec: &ToolSpec| !spec.full_only || wording.assistance == Assistance::Full;
    let whose = |spec: &ToolSpec| talk || !spec.for_operators;
    let offered = specs.filter(|spec| spec.on_episode && told(spec) && whose(spec));
    offered.map(|spec| spec.of_episode(id, robots, most_steps)).collect()
}
