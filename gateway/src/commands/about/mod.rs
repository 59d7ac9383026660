//! Information about the program itself: tasks, examples, manual pages and shell completions.

pub mod completions;
pub mod examples;
pub mod man;
pub mod tasks;
