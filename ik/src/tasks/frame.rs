//! A frame at a pose in the root's frame.

use nalgebra::Isometry3;

use super::goal::{FrameError, Goal, Sink, StepContext, TaskScratch};
use super::pose::{clamped, read_columns, weighted_square, write_pose_rows};
use crate::model::{Configuration, FrameId, Model};
use crate::spatial::Log6;

/// Task to move a frame to a pose. Error: e = log(frame^-1 target), 6, [m; rad], in the frame itself;
/// J = J_l^-1(e) J_body, with J_l the left Jacobian of SE(3).
#[derive(Clone, Debug)]
pub struct FrameTask {
    /// The frame to move.
    pub frame: FrameId,
    /// Target pose in the root's frame.
    pub target: Isometry3<f64>,
    /// Cost per metre.
    pub position_cost: f64,
    /// Cost per radian.
    pub orientation_cost: f64,
    /// Gain alpha in 0..=1: the share of the error to remove in one step.
    pub gain: f64,
    /// Levenberg-Marquardt damping lambda, dimensionless.
    pub lm_damping: f64,
}

impl FrameTask {
    /// Creates a task with cost 1 per metre and per radian, gain 1, no Levenberg-Marquardt damping.
    pub fn new(frame: FrameId, target: Isometry3<f64>) -> FrameTask {
        FrameTask { frame, target, position_cost: 1.0, orientation_cost: 1.0, gain: 1.0, lm_damping: 0.0 }
    }

    /// Returns the remaining error; a component without cost counts as 0.
    pub fn error(&self, configuration: &Configuration) -> FrameError {
        FrameError::of(&self.missing(configuration), [self.position_cost, self.orientation_cost])
    }

    fn missing(&self, configuration: &Configuration) -> Isometry3<f64> {
        configuration.root_from_frame(self.frame).inverse() * self.target
    }
}

impl Goal for FrameTask {
    fn frame_error(&self, configuration: &Configuration) -> Option<FrameError> {
        Some(self.error(configuration))
    }

    fn objective(&self, configuration: &Configuration) -> f64 {
        let weights = [self.position_cost, self.orientation_cost];
        0.5 * self.gain * weighted_square(&Log6::of(&self.missing(configuration)).twist, weights)
    }

    fn describe(&self, model: &Model) -> String {
        format!("pose of {}", model.frame_name(self.frame))
    }

    fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut dyn Sink,
    ) {
        let missing = Log6::of(&clamped(&self.missing(configuration), context.error_clamp));
        read_columns(scratch, configuration, self.frame, &missing);
        let weights = [self.position_cost, self.orientation_cost];
        write_pose_rows(scratch, &missing.twist, weights, self.gain, sink);
        sink.damp(self.lm_damping * self.gain * self.gain * weighted_square(&missing.twist, weights));
    }
}
