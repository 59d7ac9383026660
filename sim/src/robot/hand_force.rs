//! External force on each hand, estimated from the arm's own joint torques.
//!
//! At rest  tau - tau_gravity = -J^T f  with f the force on the palm, so
//!   f = -(J J^T + damping I)^-1 J (tau - tau_gravity),   J: 3 x 7 [m],
//! low-passed. Damping keeps a stretched arm, which cannot feel along itself, from reporting nonsense.

use rapier3d::math::Vector;
use rapier3d::na::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::{ARM_JOINTS, ARMS, JOINTS, WholeBody};
use crate::{Side, Sides};

/// Slow against the arm's own motion, fast against a partner who starts to pull.
const FILTER_TIME_S: f32 = 0.2;
const DAMPING_M2: f32 = 0.002;
/// More than an arm can hold is an impact.
const LARGEST_FORCE_N: f32 = 80.0;

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct HandForce {
    force_n: Sides<Vector>,
}

impl HandForce {
    /// World frame.
    pub(super) fn force_n(&self) -> Sides<Vector> {
        self.force_n
    }

    /// One physics step: `torque_n_m` are the drives' torques of the last step.
    pub(super) fn update(
        &mut self,
        body: &WholeBody,
        torque_n_m: &[f32],
        gravity_n_m: &[f32; JOINTS],
        dt_s: f32,
    ) {
        for (side, palm_m) in Side::BOTH.into_iter().zip(body.palms_m()) {
            let first = ARMS[side];
            let jacobian_m = SMatrix::<f32, 3, ARM_JOINTS>::from_fn(|row, column| {
                body.moment_n_m(first + column, palm_m, [Vector::X, Vector::Y, Vector::Z][row])
            });
            let excess_n_m = SVector::<f32, ARM_JOINTS>::from_fn(|joint, _| {
                torque_n_m[first + joint] - gravity_n_m[first + joint]
            });
            let normal_m2 = jacobian_m * jacobian_m.transpose() + SMatrix::identity() * DAMPING_M2;
            let Some(factor) = normal_m2.cholesky() else { continue };
            let fitted = factor.solve(&(jacobian_m * -excess_n_m));
            let measured_n = Vector::new(fitted.x, fitted.y, fitted.z).clamp_length_max(LARGEST_FORCE_N);
            let force_n = &mut self.force_n[side];
            *force_n += (measured_n - *force_n) * (dt_s / FILTER_TIME_S);
        }
    }
}
