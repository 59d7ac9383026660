//! Barriers: distances that must not shrink below a margin, as linear constraints on dq.
//!
//! For a distance h(q) with margin m the row  dh/dq dq >= -gain (h - m)  lets h approach m exponentially and not cross
//! it. Source: Ames et al., Control barrier functions: theory and applications, 2019.
//!
//! Rows come and go without a jump in dq if the range, where a pair's row first appears, is so far out that the row does
//! not bind there:  gain (range - margin) >= what the joints can close in one step.

mod capsule;
mod position;
mod self_collision;

#[cfg(test)]
mod tests;

pub use capsule::Capsule;
pub(crate) use capsule::Segment;
pub use position::PositionBarrier;
pub use self_collision::{ClosestPair, SelfCollision};
