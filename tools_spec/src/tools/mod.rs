//! One file per tool: its arguments, whose doc comments a model reads, and its reply.

mod check_reach;
mod finish;
mod get_robot_state;
mod get_status;
mod list_tasks;
mod move_wrists;
mod observe;
mod query_depth;
mod say;
mod send_joint_chunk;
mod start_episode;
mod wait;
mod walk;

pub use check_reach::{CheckReach, HandReach, ReachReply};
pub use finish::{EndReason, Finish, PhaseTimes, ResultReply};
pub use get_robot_state::{GetRobotState, RobotState};
pub use get_status::{GetStatus, StatusReply};
pub use list_tasks::{ListTasks, PhaseInfo, ProtocolInfo, TaskInfo, TaskList};
pub use move_wrists::{MoveWrists, WristMove};
pub use observe::{CameraCalibration, CameraImage, Observation, Observe};
pub use query_depth::{DepthPoint, DepthReply, QueryDepth};
pub use say::Say;
pub use send_joint_chunk::{ACTION_ROW_LEN, JointChunk, SendJointChunk, action_row_layout};
pub use start_episode::{
    Brief, Briefing, Instruction, JointInfo, RobotInfo, RobotKind, StartEpisode, StartReply,
};
pub use wait::Wait;
pub use walk::{Walk, WalkMove};
