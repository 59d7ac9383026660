//! The interface of all tasks, the error of a frame, and the receiver of a task's rows.

use nalgebra::{Isometry3, Vector3, Vector6};

use crate::model::{Configuration, Model};

/// One kind of task, which a [`super::Task`] delegates to.
pub(crate) trait Goal {
    /// Returns the error of a frame's pose or of the centre of mass. Returns `None` for tasks without such a
    /// target.
    fn frame_error(&self, _: &Configuration) -> Option<FrameError> {
        None
    }

    /// Returns alpha/2 |W e|^2; 0 for tasks on velocities, which a line search leaves alone.
    fn objective(&self, _: &Configuration) -> f64 {
        0.0
    }

    /// Describes the subject of the task, for messages.
    fn describe(&self, model: &Model) -> String;

    /// Writes  W J  and  alpha W e  at `configuration`.
    fn write(
        &self,
        configuration: &Configuration,
        context: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut dyn Sink,
    );
}

/// Receiver of a task's weighted rows.
pub(crate) trait Sink {
    /// Adds one row: (joint, W J) for the joints that move it, and  alpha W e.
    fn row(&mut self, entries: &[(usize, f64)], error: f64);
    /// Adds the same weight on every joint: W 1 dq = W e, with e per joint.
    fn diagonal(&mut self, weight: f64, error: &dyn Fn(usize) -> f64);
    /// Adds mu on every joint.
    fn damp(&mut self, mu: f64);
}

/// Context of a step beside the configuration.
pub(crate) struct StepContext<'a> {
    pub dt_s: f64,
    pub last_velocity: &'a [f64],
    /// Maximum errors of frames; larger ones are clamped.
    pub error_clamp: Option<FrameError>,
}

/// Buffers of one evaluation, so that evaluations do not allocate.
#[derive(Default)]
pub(crate) struct TaskScratch {
    pub columns: Vec<(usize, Vector6<f64>)>,
    pub entries: Vec<(usize, f64)>,
    pub centre: Vec<Vector3<f64>>,
}

impl TaskScratch {
    pub(crate) fn new(nv: usize) -> TaskScratch {
        TaskScratch {
            columns: Vec::with_capacity(2 * nv),
            entries: Vec::with_capacity(2 * nv),
            centre: vec![Vector3::zeros(); nv],
        }
    }
}

/// Distance of a frame from its target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameError {
    /// Distance of the origins, m.
    pub position_m: f64,
    /// Angle between the orientations, rad.
    pub orientation_rad: f64,
}

impl FrameError {
    pub(super) fn of(missing: &Isometry3<f64>, [position_cost, orientation_cost]: [f64; 2]) -> FrameError {
        FrameError {
            position_m: if position_cost > 0.0 { missing.translation.vector.norm() } else { 0.0 },
            orientation_rad: if orientation_cost > 0.0 { missing.rotation.angle() } else { 0.0 },
        }
    }

    /// Returns the squared error, with metres and radians weighted alike.
    pub(crate) fn squared(&self) -> f64 {
        self.position_m.powi(2) + self.orientation_rad.powi(2)
    }
}

/// Maximum error per step of a complete solution, so that far targets do not upset near joints.
pub(crate) const ERROR_CLAMP: FrameError = FrameError { position_m: 0.3, orientation_rad: 0.9 };
