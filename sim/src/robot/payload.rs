//! Weight carried by each hand, estimated from the arm's own joint torques, and fed forward.
//!
//! At rest the torque beyond gravity is J^T f with f the load at the palm. Only the vertical part is estimated, as the
//! least squares fit  w = -(J_z . tau) / (J_z . J_z),  low-passed, and never negative: pushing on a table is not a load.

use rapier3d::math::Vector;
use serde::{Deserialize, Serialize};

use super::{ARM_JOINTS, ARMS, JOINTS, WholeBody};
use crate::{Side, Sides};

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
    weight_n: Sides<f32>,
}

impl Payload {
    pub(super) fn weight_n(&self) -> Sides<f32> {
        self.weight_n
    }

    /// One physics step: `torque_n_m` are the drives' torques of the last step.
    pub(super) fn update(
        &mut self,
        body: &WholeBody,
        torque_n_m: &[f32],
        gravity_n_m: &[f32; JOINTS],
        dt_s: f32,
    ) {
        for side in Side::BOTH {
            let lever_m = vertical_levers_m(body, side);
            let square: f32 = lever_m.iter().map(|lever| lever * lever).sum();
            let excess_n_m: [f32; ARM_JOINTS] = std::array::from_fn(|i| {
                let joint = ARMS[side] + i;
                torque_n_m[joint] - gravity_n_m[joint]
            });
            let along: f32 = lever_m.iter().zip(&excess_n_m).map(|(lever, excess)| lever * excess).sum();
            let total: f32 = excess_n_m.iter().map(|excess| excess * excess).sum();
            let explained = along * along / (square * total).max(1e-6);
            let measured_n = if explained > LEAST_EXPLAINED { along / square } else { 0.0 };
            let measured_n = measured_n.clamp(0.0, LARGEST_WEIGHT_N);
            let weight_n = &mut self.weight_n[side];
            *weight_n += (measured_n - *weight_n) * (dt_s / FILTER_TIME_S);
        }
    }

    /// Torques that carry the estimated weights.
    pub(super) fn torques_n_m(&self, body: &WholeBody) -> [f32; JOINTS] {
        let mut torques_n_m = [0.0; JOINTS];
        for side in Side::BOTH {
            let levers_m = vertical_levers_m(body, side);
            for (lever_m, joint) in levers_m.into_iter().zip(ARMS[side]..) {
                torques_n_m[joint] = GAIN * self.weight_n[side] * lever_m;
            }
        }
        torques_n_m
    }
}

/// Torque of each arm joint per newton of upward force at the palm.
fn vertical_levers_m(body: &WholeBody, side: Side) -> [f32; ARM_JOINTS] {
    let hand = body.model.hands[side].wrist;
    let palm_m = body.world_from_link[hand] * Vector::new(0.12, 0.0, 0.0);
    std::array::from_fn(|i| body.moment_n_m(ARMS[side] + i, palm_m, Vector::Z))
}
