//! The centre of mass at a point.

use nalgebra::Vector3;

use super::goal::{FrameError, Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Task to move the centre of mass to a point. e = target - centre, 3, m.
#[derive(Clone, Debug)]
pub struct CenterOfMassTask {
    /// Target in the root's frame, m.
    pub target: Vector3<f64>,
    /// Cost per metre, along the root's axes; 0 leaves an axis free.
    pub cost: Vector3<f64>,
    /// Gain alpha in 0..=1.
    pub gain: f64,
}

impl CenterOfMassTask {
    fn missing(&self, configuration: &Configuration) -> Vector3<f64> {
        self.target - configuration.center_of_mass()
    }
}

impl Goal for CenterOfMassTask {
    fn frame_error(&self, configuration: &Configuration) -> Option<FrameError> {
        let asked = self.cost.map(|cost| if cost > 0.0 { 1.0 } else { 0.0 });
        let missing = self.missing(configuration).component_mul(&asked);
        Some(FrameError { position_m: missing.norm(), orientation_rad: 0.0 })
    }

    fn objective(&self, configuration: &Configuration) -> f64 {
        0.5 * self.gain * self.missing(configuration).component_mul(&self.cost).norm_squared()
    }

    fn describe(&self, _: &Model) -> String {
        "centre of mass".into()
    }

    fn write(
        &self,
        configuration: &Configuration,
        _: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut dyn Sink,
    ) {
        configuration.center_of_mass_jacobian(&mut scratch.centre);
        let missing = self.missing(configuration);
        for axis in 0..3 {
            let cost = self.cost[axis];
            scratch.entries.clear();
            scratch.entries.extend(
                scratch.centre.iter().enumerate().map(|(joint, column)| (joint, cost * column[axis])),
            );
            sink.row(&scratch.entries, cost * self.gain * missing[axis]);
        }
    }
}
