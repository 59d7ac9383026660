//! Joints that move at given speeds.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Asks for joint speeds. J = 1 / dt, e = target, nv, rad/s.
#[derive(Clone, Debug)]
pub struct JointVelocityTask {
    /// Model order, rad/s or m/s.
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
