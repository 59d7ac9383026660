//! A plane that a frame stays beyond.

use nalgebra::Vector3;

use crate::model::{Configuration, FrameId};
use crate::qp::Row;

/// Keeps the origin of a frame on one side of a plane: normal . p >= offset, in the root's frame.
#[derive(Clone, Debug)]
pub struct PositionBarrier {
    /// The frame.
    pub frame: FrameId,
    /// Unit vector to the free side.
    pub normal: Vector3<f64>,
    /// m.
    pub offset_m: f64,
    /// Part of the distance that one step may take.
    pub gain: f64,
}

impl PositionBarrier {
    /// Distance of the frame's origin to the plane, m; negative beyond it.
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
