//! All joints near given coordinates.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Keeps all joints near coordinates. J = 1, e = target - q, nv.
#[derive(Clone, Debug)]
pub struct PostureTask {
    /// Model order, rad or m.
    pub target: Vec<f64>,
    /// Cost per rad or m.
    pub cost: f64,
    /// alpha in 0..=1.
    pub gain: f64,
}

impl Goal for PostureTask {
    fn objective(&self, configuration: &Configuration) -> f64 {
        let missing = self.target.iter().zip(configuration.q()).map(|(target, q)| (target - q).powi(2));
        0.5 * self.gain * self.cost * self.cost * missing.sum::<f64>()
    }

    fn describe(&self, _: &Model) -> String {
        "posture".into()
    }

    fn write(
        &self,
        configuration: &Configuration,
        _: &StepContext,
        _: &mut TaskScratch,
        sink: &mut dyn Sink,
    ) {
        let q = configuration.q();
        sink.diagonal(self.cost, &|joint| self.gain * (self.target[joint] - q[joint]));
    }
}
