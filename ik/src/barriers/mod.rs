//! Barriers: distances that must not shrink below a margin, as linear constraints on dq.
//!
//! For a distance h(q) with margin m the row  dh/dq dq >= -gain (h - m)  lets h approach m exponentially
//! and not cross it. Source: Ames et al., Control barrier functions: theory and applications, 2019.
//!
//! Rows appear and disappear without a jump in dq if the range, where a pair's row first appears, is
//! large enough that the row does not bind there:  gain (range - margin) >= the distance that the joints
//! can close in one step.

mod capsule;
mod self_collision;

pub use capsule::Capsule;
pub(crate) use capsule::Segment;
pub use self_collision::{ClosestPair, SelfCollision};

use nalgebra::Vector3;

use crate::model::{Configuration, FrameId};
use crate::qp::Row;

/// A plane on whose free side a frame stays: normal . p >= offset, with p the origin of the frame in the
/// root's frame.
#[derive(Clone, Debug)]
pub struct PositionBarrier {
    /// Frame that stays on the free side.
    pub frame: FrameId,
    /// Unit normal, root's frame, towards the free side.
    pub normal: Vector3<f64>,
    /// Offset of the plane along the normal, m.
    pub offset_m: f64,
    /// Share of the distance to the plane that one step may take.
    pub gain: f64,
}

impl PositionBarrier {
    /// Returns the signed distance of the frame's origin from the plane, m; positive on the free side.
    pub fn height_m(&self, configuration: &Configuration) -> f64 {
        self.normal.dot(&configuration.root_from_frame(self.frame).translation.vector) - self.offset_m
    }

    pub(crate) fn write(&self, configuration: &Configuration, row: &mut Row) {
        let point = configuration.root_from_frame(self.frame).translation.vector;
        for &joint in configuration.model().support(self.frame) {
            row.coefficients[joint] = self.normal.dot(&configuration.velocity_of_point(&point, joint).0);
        }
        row.bound = -self.gain * self.height_m(configuration);
    }
}
