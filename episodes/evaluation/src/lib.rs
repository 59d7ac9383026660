//! Evaluation: many episodes that policies play, their results as reports, and the tools around tasks and
//! training. A session and its recording know nothing of this crate.

pub mod batch;
pub mod evaluation;
pub mod policies;
pub mod reports;
pub mod results;
mod robot_check;
pub mod statistics;
mod task_check;
mod task_draft;

pub use robot_check::{RobotCheck, check_robot, draft_robot};
pub use task_check::{TaskCheck, TaskCheckError, check_task};
pub use task_draft::{TaskDraft, TaskDraftError, draft_task};
