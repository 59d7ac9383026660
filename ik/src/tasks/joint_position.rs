//! Tasks on joint coordinates: all joints near given coordinates, or some joints in a linear relation.

use super::goal::{Goal, Sink, StepContext, TaskScratch};
use crate::model::{Configuration, Model};

/// Task to keep all joints near coordinates. J = 1, e = target - q, nv.
#[derive(Clone, Debug)]
pub struct PostureTask {
    /// Target coordinates in model order, rad or m.
    pub target: Vec<f64>,
    /// Cost per rad or m.
    pub cost: f64,
    /// Gain alpha in 0..=1.
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

/// Task to keep  sum_i ratio_i q_i = offset, with each joint named once.  J = ratios, e = offset - ratios' q,
/// 1.
#[derive(Clone, Debug)]
pub struct JointCouplingTask {
    /// Joints with their ratios.
    pub ratios: Vec<(usize, f64)>,
    /// Offset, rad or m.
    pub offset: f64,
    /// Cost per rad or m.
    pub cost: f64,
    /// Gain alpha in 0..=1.
    pub gain: f64,
}

impl JointCouplingTask {
    fn missing(&self, configuration: &Configuration) -> f64 {
        self.offset - self.ratios.iter().map(|(joint, ratio)| ratio * configuration.q()[*joint]).sum::<f64>()
    }
}

impl Goal for JointCouplingTask {
    fn objective(&self, configuration: &Configuration) -> f64 {
        0.5 * self.gain * (self.cost * self.missing(configuration)).powi(2)
    }

    fn describe(&self, model: &Model) -> String {
        let joints: Vec<&str> =
            self.ratios.iter().map(|(joint, _)| model.joints()[*joint].name.as_str()).collect();
        format!("coupling of {}", joints.join(", "))
    }

    fn write(
        &self,
        configuration: &Configuration,
        _: &StepContext,
        scratch: &mut TaskScratch,
        sink: &mut dyn Sink,
    ) {
        scratch.entries.clear();
        scratch.entries.extend(self.ratios.iter().map(|(joint, ratio)| (*joint, self.cost * ratio)));
        sink.row(&scratch.entries, self.cost * self.gain * self.missing(configuration));
    }
}
