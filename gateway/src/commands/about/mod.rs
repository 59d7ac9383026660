//! What the program says of itself: its tasks, its manual pages, and what shells complete.

pub mod completions;
pub mod man;
pub mod tasks;
