//! Evaluation: policies that play many episodes, reports of the results, and tools for tasks and training.
//! Sessions and recordings do not depend on this crate.

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
