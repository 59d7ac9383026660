//! External force on a hand, estimated from the arm's own joint torques.
//!
//! At rest  tau - tau_gravity = -J^T f  with f the force on the palm, so
//!   f = -(J J^T + damping I)^-1 J (tau - tau_gravity),   J: 3 x 7 [m],
//! low-passed. Damping keeps a stretched arm, which cannot feel along itself, from reporting nonsense.

use rapier3d::math::Vector;
use rapier3d::na::{SMatrix, SVector};
use serde::{Deserialize, Serialize};

use super::arm::Arm;
use crate::body::ARM_JOINTS;

/// Slow against the arm's own motion, fast against a partner who starts to pull.
const FILTER_TIME_S: f32 = 0.2;
const DAMPING_M2: f32 = 0.002;
/// More than an arm can hold is an impact.
const LARGEST_FORCE_N: f32 = 80.0;

#[derive(Clone, Default, Serialize, Deserialize)]
pub(super) struct HandForce {
    force_n: Vector,
}

impl HandForce {
    /// World frame.
    pub(super) fn force_n(&self) -> Vector {
        self.force_n
    }

    /// One physics step.
    pub(super) fn update(&mut self, arm: &Arm, dt_s: f32) {
        let jacobian_m = SMatrix::<f32, 3, ARM_JOINTS>::from_fn(|row, column| arm.levers_m[row][column]);
        let excess_n_m = SVector::from(arm.excess_n_m);
        let normal_m2 = jacobian_m * jacobian_m.transpose() + SMatrix::identity() * DAMPING_M2;
        let Some(factor) = normal_m2.cholesky() else { return };
        let fitted = factor.solve(&(jacobian_m * -excess_n_m));
        let measured_n = Vector::new(fitted.x, fitted.y, fitted.z).clamp_length_max(LARGEST_FORCE_N);
        self.force_n += (measured_n - self.force_n) * (dt_s / FILTER_TIME_S);
    }
}
