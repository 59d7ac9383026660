//! A frame at a pose in another frame.

use nalgebra::Isometry3;

use super::goal::{FrameError, Goal, Sink, StepContext, TaskScratch};
use super::pose::{clamped, read_columns, weighted_square, write_pose_rows};
use crate::model::{Configuration, FrameId, Model};
use crate::spatial::Log6;

/// Task to move a frame to a pose in another frame that moves too.
#[derive(Clone, Debug)]
pub struct RelativeFrameTask {
    /// The frame to move.
    pub frame: FrameId,
    /// The frame that the target is given in.
    pub reference: FrameId,
    /// Target pose of `frame`, in `reference`.
    pub target: Isometry3<f64>,
    /// Cost per metre.
    pub position_cost: f64,
    /// Cost per radian.
    pub orientation_cost: f64,
    /// Gain alpha in 0..=1.
    pub gain: f64,
}

impl RelativeFrameTask {
    fn missing(&self, configuration: &Configuration) -> Isometry3<f64> {
        let frame_from_root = configuration.root_from_frame(self.frame).inverse();
        frame_from_root * configuration.root_from_frame(self.reference) * self.target
    }
}

impl Goal for RelativeFrameTask {
    fn frame_error(&self, configuration: &Configuration) -> Option<FrameError> {
        Some(FrameError::of(&self.missing(configuration), [self.position_cost, self.orientation_cost]))
    }

    fn objective(&self, configuration: &Configuration) -> f64 {
        let weights = [self.position_cost, self.orientation_cost];
        0.5 * self.gain * weighted_square(&Log6::of(&self.missing(configuration)).twist, weights)
    }

    fn describe(&self, model: &Model) -> String {
        format!("pose of {} in {}", model.frame_name(self.frame), model.frame_name(self.reference))
    }

    fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut dyn Sink,
    ) {
        let root_from_frame = configuration.root_from_frame(self.frame);
        let missing = Log6::of(&clamped(&self.missing(configuration), context.error_clamp));
        read_columns(scratch, configuration, self.frame, &missing);
        // The target moves along with the reference: relative to the frame it moves the other way.
        for &joint in configuration.model().support(self.reference) {
            let (linear, angular) =
                configuration.velocity_of_point(&root_from_frame.translation.vector, joint);
            let frame_from_root = root_from_frame.rotation.inverse();
            let carried = missing.transform(&(frame_from_root * linear), &(frame_from_root * angular));
            match scratch.columns.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, column)) => *column -= carried,
                None => scratch.columns.push((joint, -carried)),
            }
        }
        let weights = [self.position_cost, self.orientation_cost];
        write_pose_rows(scratch, &missing.twist, weights, self.gain, sink);
    }
}
