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
mod send_joint_drives;
mod send_plan;
mod start_episode;
mod wait;
mod walk;
mod walk_to;

pub use check_reach::{CheckReach, HandReach, ReachReply};
pub use finish::{EndReason, Finish, PhaseTimes, ResultReply};
pub use get_robot_state::{GetRobotState, RobotState, SensorSamples};
pub use get_status::{GetStatus, StatusReply};
pub use list_tasks::{ListTasks, ProtocolInfo, TaskInfo, TaskList};
pub use move_wrists::{MoveWrists, WristMove};
pub use observe::{
    CameraCalibration, CameraImage, DepthImage, ImageLink, LensDistortion, Observation, Observe,
};
pub use query_depth::{
    Color, DepthReply, DepthRow, EdgeFit, JoinedBy, PlaneFit, QueryDepth, RegionFit, Surface, SurfaceQuery,
    UprightAxis,
};
pub use say::Say;
pub use send_joint_chunk::{ACTION_ROW_LEN, JointChunk, SendJointChunk, action_row_layout};
pub use send_joint_drives::{DRIVE_BLOCKS, DRIVE_ROW_LEN, JointDrives, SendJointDrives};
pub use send_plan::{Expectation, PlannedCommand, SendPlan};
pub use start_episode::{
    Brief, Briefing, Instruction, JointInfo, PhaseInfo, RobotInfo, RobotKind, StartEpisode, StartReply,
    WorkedGrip,
};
pub use wait::Wait;
pub use walk::{Walk, WalkMove};
pub use walk_to::{Destination, WalkTo, Waypoint};
