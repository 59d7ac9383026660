//! Start states of episodes.

use std::path::PathBuf;

use serde::{Deserialize, Serialize};
use tandem_sim::CONTROL_HZ;

/// Start state of an episode.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Start {
    /// The task's own start under the seed.
    #[default]
    Task,
    /// The state in a [`crate::Checkpoint`]'s file of the same task, seed, protocol, robot and controller.
    Checkpoint(PathBuf),
    /// The start of a recorded phase of the same task, seed, robot and controller, with the whole budget.
    Phase(PhaseStart),
    /// A moment of a recorded episode of the same task, seed, robot and controller, with the whole budget.
    Moment(MomentStart),
}

impl Start {
    /// Describes a start at a chosen moment, for display after the policy's name; `None` for other starts.
    pub(super) fn peculiarity(&self) -> Option<String> {
        match self {
            Start::Moment(MomentStart { before_s: Some(before_s), .. }) => {
                Some(format!("begun again {before_s} s before it went wrong"))
            }
            Start::Moment(MomentStart { before_s: None, control_step, .. }) => {
                Some(format!("taken over at {:.1} s", *control_step as f64 / CONTROL_HZ))
            }
            Start::Task | Start::Checkpoint(_) | Start::Phase(_) => None,
        }
    }
}

/// A moment of a recorded episode. All calls answered by then are replayed.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct MomentStart {
    /// Path of an `episode.mcap`.
    pub recording: PathBuf,
    /// Control step of the recorded episode.
    pub control_step: u64,
    /// Seconds before the failure of the recorded episode; `None` if an operator took over.
    #[serde(default)]
    pub before_s: Option<u32>,
}

/// The beginning of a phase of a recorded episode.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct PhaseStart {
    /// Path of an `episode.mcap`.
    pub recording: PathBuf,
    /// Number of the phase, for example `p2`.
    pub phase: String,
}
