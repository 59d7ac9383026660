//! Joints that keep their speed.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Costs changes of joint speed since the last step. J = 1 / dt, e = last velocity, nv, rad/s.
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
