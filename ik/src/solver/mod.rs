//! From tasks, limits and barriers to joints that move: one step, steps that never make things worse, whole solutions.

mod displacement;
mod limits;
mod program;
mod report;
mod solve;
mod step;
mod track;

pub use limits::{LimitKind, Limits};
pub use report::{ClampedJoint, Outcome, SolveReport, Tolerance, saturated};
pub use solve::SolveOptions;
pub(crate) use solve::random_coordinate;
pub use step::{Solver, frame_errors};
