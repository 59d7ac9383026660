//! Slow joints.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Costs joint speed: J = 1 / dt, e = 0, nv, rad/s. Pink's damping task leaves dt out; its cost is this one's over dt.
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
