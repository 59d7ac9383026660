//! Scoring: the holds in each control step, and the phases reached by them. It depends on steps alone, not on
//! tasks.

mod facts;
mod facts_tracker;
mod grasps;
pub mod nearness;
mod phases;
pub mod placement;
mod scores;

pub use facts::{A, B, C, Facts, Grip, ObjectFacts, ROBOT_NAMES, RobotFacts};
pub use phases::{Condition, Done, Milestone, Nearness, Phase, PhaseMemory, Predicate};
pub use scores::{ScoreMemory, Scores, StepScore};
