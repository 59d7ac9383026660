//! Information about the program itself: tasks, manual pages and shell completions.

pub mod completions;
pub mod man;
pub mod tasks;
