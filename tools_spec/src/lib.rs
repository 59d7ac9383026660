//! The wire contract: every tool that a policy can call, with its arguments, its reply and its JSON Schema.
//!
//! The doc comments of the argument types are the text that a language model reads, so they say units, frames and what
//! happens. Nothing here knows the simulator: [`ToolCall::parse`] checks what can be checked without looking at a world.
//!
//! To add a tool: one file in `tools/` and its line in `list.rs`. What does not answer it yet does not compile.

#![warn(missing_docs)]

mod checks;
mod error;
mod list;
mod openapi;
mod parts;
mod schema;
mod tool;
mod tools;

pub use error::{ProblemBody, SpecError};
pub use list::{
    ActCall, EPISODE_TOOLS, LookCall, LookReply, ManageCall, ManageReply, ToolCall, ToolReply, tool_specs,
};
pub use openapi::openapi;
pub use parts::{
    Budget, CommandReply, HandReport, JointValues, PhaseReached, Png, Pose, Protocol, RobotFallen,
    RobotReport, StopReason,
};
pub use tool::{Tool, ToolSpec, parse_args};
pub use tools::check_reach::{CheckReach, HandReach, ReachReply};
pub use tools::finish::{EndReason, Finish, PhaseTimes, ResultReply};
pub use tools::get_robot_state::{BaseCommand, GetRobotState, RobotState};
pub use tools::get_status::{GetStatus, StatusReply};
pub use tools::list_tasks::{ListTasks, PhaseInfo, ProtocolInfo, TaskInfo, TaskList};
pub use tools::move_wrists::{MoveWrists, WristMove};
pub use tools::observe::{CameraCalibration, CameraImage, Observation, Observe};
pub use tools::query_depth::{DepthPoint, DepthReply, QueryDepth};
pub use tools::send_joint_chunk::{ACTION_ROW_LEN, JointChunk, SendJointChunk, action_row_layout};
pub use tools::start_episode::{
    BaseLimits, Briefing, Instruction, JointInfo, Range, RobotInfo, StartEpisode, StartReply,
};
pub use tools::wait::Wait;
pub use tools::walk::{Walk, WalkMove};
