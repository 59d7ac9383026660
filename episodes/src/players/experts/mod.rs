//! Experts: scripts that solve the tasks, as proof that scene, physics, phases and tools fit together.
//!
//! An expert sees [`Facts`], which no policy does; that is its only privilege. It acts through the same tool calls as
//! everybody, and each call is charged to the episode's budget.

mod bar;
mod co_pouring;
mod frame_hang;
mod grasp;
mod handover;
mod pouring;
mod stage;

use tandem_tools_spec::{ToolCall, ToolReply};

use crate::facts::Facts;
use crate::tasks::Task;
pub use stage::Stage;

/// Where an expert performs: an episode behind HTTP or in the same process.
pub trait Arena {
    /// Makes a tool call on the episode.
    fn call(&mut self, call: ToolCall) -> Result<ToolReply, ExpertError>;

    /// Looks behind the curtain.
    fn facts(&mut self) -> Result<Facts, ExpertError>;
}

/// Why an expert gave up.
#[derive(Debug, thiserror::Error)]
pub enum ExpertError {
    #[error("no expert for task {task:?}; have: {have}")]
    NoExpert { task: String, have: String },
    #[error("the episode has ended")]
    EpisodeOver,
    #[error("{tool} failed: {reason}")]
    Call { tool: &'static str, reason: String },
    #[error("{0}")]
    GaveUp(String),
}

/// Performs a task to its end.
type Script = fn(&mut Stage) -> Result<(), ExpertError>;

const ALL: &[(&str, Script)] = &[
    ("handover", handover::perform),
    ("pouring", pouring::perform),
    ("frame_hang", frame_hang::perform),
    ("co_pouring", co_pouring::perform),
];

/// Performs `task` in `arena` until it is done, the episode ends, or the expert gives up. An episode that ends under
/// way is no error: the last phase may have been reached.
pub fn perform(task: &Task, arena: &mut dyn Arena) -> Result<(), ExpertError> {
    let script = ALL.iter().find(|(id, _)| *id == task.id).map(|(_, script)| script);
    let script = script.ok_or_else(|| ExpertError::NoExpert {
        task: task.id.into(),
        have: ALL.iter().map(|(id, _)| *id).collect::<Vec<_>>().join(", "),
    })?;
    match script(&mut Stage::new(arena)?) {
        Err(ExpertError::EpisodeOver) => Ok(()),
        outcome => outcome,
    }
}
