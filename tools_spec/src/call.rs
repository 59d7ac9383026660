//! All tools in one list, a call that has been read and checked, and its reply.

use serde::Serialize;
use serde_json::Value;

use crate::{
    CheckReach, CommandReply, DepthReply, Finish, GetRobotState, GetStatus, ListTasks, MoveWrists,
    Observation, Observe, QueryDepth, ReachReply, ResultReply, RobotState, SendJointChunk, SpecError,
    StartEpisode, StatusReply, Tool, ToolSpec, Wait, Walk, parse_args,
};

/// Every tool, in the order a policy meets them.
pub fn tool_specs() -> Vec<ToolSpec> {
    vec![
        ToolSpec::of::<ListTasks>(),
        ToolSpec::of::<StartEpisode>(),
        ToolSpec::of::<Observe>(),
        ToolSpec::of::<GetRobotState>(),
        ToolSpec::of::<QueryDepth>(),
        ToolSpec::of::<CheckReach>(),
        ToolSpec::of::<MoveWrists>(),
        ToolSpec::of::<Walk>(),
        ToolSpec::of::<SendJointChunk>(),
        ToolSpec::of::<Wait>(),
        ToolSpec::of::<GetStatus>(),
        ToolSpec::of::<Finish>(),
    ]
}

/// The tools that act on an episode, by name.
pub const EPISODE_TOOLS: &[&str] = &[
    Observe::NAME,
    GetRobotState::NAME,
    QueryDepth::NAME,
    CheckReach::NAME,
    MoveWrists::NAME,
    Walk::NAME,
    SendJointChunk::NAME,
    Wait::NAME,
    GetStatus::NAME,
    Finish::NAME,
];

/// A call on an episode, read and checked as far as that needs no world.
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
#[expect(missing_docs, reason = "each variant is the tool of its name, described on its type")]
pub enum ToolCall {
    Observe(Observe),
    GetRobotState(GetRobotState),
    QueryDepth(QueryDepth),
    CheckReach(CheckReach),
    MoveWrists(MoveWrists),
    Walk(Walk),
    SendJointChunk(SendJointChunk),
    Wait(Wait),
    GetStatus(GetStatus),
    Finish(Finish),
}

impl ToolCall {
    /// Reads the call of tool `name` with arguments `args`, without `episode_id`.
    pub fn parse(name: &str, args: Value) -> Result<ToolCall, SpecError> {
        match name {
            Observe::NAME => parse_args(args).map(ToolCall::Observe),
            GetRobotState::NAME => parse_args(args).map(ToolCall::GetRobotState),
            QueryDepth::NAME => parse_args(args).map(ToolCall::QueryDepth),
            CheckReach::NAME => parse_args(args).map(ToolCall::CheckReach),
            MoveWrists::NAME => parse_args(args).map(ToolCall::MoveWrists),
            Walk::NAME => parse_args(args).map(ToolCall::Walk),
            SendJointChunk::NAME => parse_args(args).map(ToolCall::SendJointChunk),
            Wait::NAME => parse_args(args).map(ToolCall::Wait),
            GetStatus::NAME => parse_args(args).map(ToolCall::GetStatus),
            Finish::NAME => parse_args(args).map(ToolCall::Finish),
            _ => Err(SpecError::UnknownTool { name: name.into(), have: EPISODE_TOOLS.to_vec() }),
        }
    }

    /// The tool's name. The call itself serialises to its arguments.
    pub fn name(&self) -> &'static str {
        match self {
            ToolCall::Observe(_) => Observe::NAME,
            ToolCall::GetRobotState(_) => GetRobotState::NAME,
            ToolCall::QueryDepth(_) => QueryDepth::NAME,
            ToolCall::CheckReach(_) => CheckReach::NAME,
            ToolCall::MoveWrists(_) => MoveWrists::NAME,
            ToolCall::Walk(_) => Walk::NAME,
            ToolCall::SendJointChunk(_) => SendJointChunk::NAME,
            ToolCall::Wait(_) => Wait::NAME,
            ToolCall::GetStatus(_) => GetStatus::NAME,
            ToolCall::Finish(_) => Finish::NAME,
        }
    }

    /// Checks a call that was built in Rust rather than read from JSON; [`ToolCall::parse`] has already done it.
    pub fn validate(&self) -> Result<(), SpecError> {
        let checked = match self {
            ToolCall::Observe(args) => args.validate(),
            ToolCall::GetRobotState(args) => args.validate(),
            ToolCall::QueryDepth(args) => args.validate(),
            ToolCall::CheckReach(args) => args.validate(),
            ToolCall::MoveWrists(args) => args.validate(),
            ToolCall::Walk(args) => args.validate(),
            ToolCall::SendJointChunk(args) => args.validate(),
            ToolCall::Wait(args) => args.validate(),
            ToolCall::GetStatus(args) => args.validate(),
            ToolCall::Finish(args) => args.validate(),
        };
        checked.map_err(|reason| SpecError::Invalid { tool: self.name(), reason })
    }
}

/// The reply to a [`ToolCall`].
#[derive(Debug, Clone, PartialEq, Serialize)]
#[serde(untagged)]
pub enum ToolReply {
    /// To `observe`.
    Observation(Observation),
    /// To `get_robot_state`.
    RobotState(RobotState),
    /// To `query_depth`.
    Depth(DepthReply),
    /// To `check_reach`.
    Reach(ReachReply),
    /// To `move_wrists`, `walk`, `send_joint_chunk` and `wait`.
    Command(CommandReply),
    /// To `get_status`.
    Status(StatusReply),
    /// To `finish`.
    Result(ResultReply),
}

impl ToolReply {
    /// Reads the reply of tool `name`, for clients written in Rust.
    pub fn parse(name: &str, reply: Value) -> Result<ToolReply, serde_json::Error> {
        match name {
            Observe::NAME => serde_json::from_value(reply).map(ToolReply::Observation),
            GetRobotState::NAME => serde_json::from_value(reply).map(ToolReply::RobotState),
            QueryDepth::NAME => serde_json::from_value(reply).map(ToolReply::Depth),
            CheckReach::NAME => serde_json::from_value(reply).map(ToolReply::Reach),
            GetStatus::NAME => serde_json::from_value(reply).map(ToolReply::Status),
            Finish::NAME => serde_json::from_value(reply).map(ToolReply::Result),
            _ => serde_json::from_value(reply).map(ToolReply::Command),
        }
    }
}
