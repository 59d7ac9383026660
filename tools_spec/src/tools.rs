//! One file per tool: its arguments, whose doc comments a model reads, and its reply.

pub mod check_reach;
pub mod finish;
pub mod get_robot_state;
pub mod get_status;
pub mod list_tasks;
pub mod move_wrists;
pub mod observe;
pub mod query_depth;
pub mod send_joint_chunk;
pub mod start_episode;
pub mod wait;
pub mod walk;
