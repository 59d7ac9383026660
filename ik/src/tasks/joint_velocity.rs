//! Tasks on the speeds of all joints: given speeds, zero, or the speeds of the last step.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Task that demands joint speeds. J = 1 / dt, e = target, nv, rad/s.
#[derive(Clone, Debug)]
pub struct JointVelocityTask {
    /// Target speeds in model order, rad/s or m/s.
    pub target: Vec<f64>,
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

impl Goal for JointVelocityTask {
    fn describe(&self, _: &Model) -> String {
        "joint velocities".into()
    }

    fn write(&self, _: &Configuration, context: &StepContext, _: &mut TaskScratch, sink: &mut dyn Sink) {
        sink.diagonal(self.cost / context.dt_s, &|joint| self.target[joint] * context.dt_s);
    }
}

/// Task that penalises joint speed: J = 1 / dt, e = 0, nv, rad/s. Pink's damping task omits dt; its cost is
/// this cost divided by dt.
#[derive(Clone, Debug)]
pub struct DampingTask {
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

impl Goal for DampingTask {
    fn describe(&self, _: &Model) -> String {
        "damping".into()
    }

    fn write(&self, _: &Configuration, context: &StepContext, _: &mut TaskScratch, sink: &mut dyn Sink) {
        sink.diagonal(self.cost / context.dt_s, &|_| 0.0);
    }
}

/// Task that penalises changes of joint speed since the last step. J = 1 / dt, e = last velocity, nv, rad/s.
#[derive(Clone, Debug)]
pub struct LowAccelerationTask {
    /// Cost per rad/s or m/s.
    pub cost: f64,
}

impl Goal for LowAccelerationTask {
    fn describe(&self, _: &Model) -> String {
        "low acceleration".into()
    }

    fn write(&self, _: &Configuration, context: &StepContext, _: &mut TaskScratch, sink: &mut dyn Sink) {
        sink.diagonal(self.cost / context.dt_s, &|joint| context.last_velocity[joint] * context.dt_s);
    }
}
