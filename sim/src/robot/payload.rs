//! Weight that a hand carries, estimated from the arm's own joint torques, and fed forward.
//!
//! At rest the torque beyond gravity is J^T f with f the load at the palm. Only the vertical part is estimated, as the
//! least squares fit  w = -(J_z . tau) / (J_z . J_z),  low-passed, and never negative: pushing on a table is not a load.

use serde::{Deserialize, Serialize};

use super::arm::Arm;
use crate::body::ARM_JOINTS;

/// Slow against the arm's own motion, fast against a lift of one second.
const FILTER_TIME_S: f32 = 0.12;
/// Part of the estimate that is fed forward. At 1 two robots that pull on one object would pull without end.
const GAIN: f32 = 0.85;
/// A weight explains at least this part of the torques; an arm that presses sideways shows another pattern.
const LEAST_EXPLAINED: f32 = 0.6;
/// Dex3-1 hands are not made for more.
const LARGEST_WEIGHT_N: f32 = 35.0;

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct Payload {
    weight_n: f32,
}

impl Payload {
    pub(super) fn weight_n(&self) -> f32 {
        self.weight_n
    }

    /// One physics step.
    pub(super) fn update(&mut self, arm: &Arm, dt_s: f32) {
        let lever_m = &arm.levers_m[2];
        let square: f32 = lever_m.iter().map(|lever| lever * lever).sum();
        let along: f32 = lever_m.iter().zip(&arm.excess_n_m).map(|(lever, excess)| lever * excess).sum();
        let total: f32 = arm.excess_n_m.iter().map(|excess| excess * excess).sum();
        let explained = along * along / (square * total).max(1e-6);
        let measured_n = if explained > LEAST_EXPLAINED { along / square } else { 0.0 };
        let measured_n = measured_n.clamp(0.0, LARGEST_WEIGHT_N);
        self.weight_n += (measured_n - self.weight_n) * (dt_s / FILTER_TIME_S);
    }

    /// Torques of the arm's joints that carry the estimated weight.
    pub(super) fn torques_n_m(&self, arm: &Arm) -> [f32; ARM_JOINTS] {
        arm.levers_m[2].map(|lever_m| GAIN * self.weight_n * lever_m)
    }
}
