//! Solvers for tasks, limits and barriers: single steps, guarded steps for streamed targets, and
//! complete solutions.

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
