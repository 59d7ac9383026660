//! SE(3): logarithm and the inverse of its left Jacobian.
//!
//! Twists are ordered [linear m; angular rad]. Source: Barfoot, State Estimation for Robotics, 2017, chapter
//! 7.

use nalgebra::{Isometry3, Matrix3, UnitQuaternion, Vector3, Vector6};

/// Angle (rad) below which series replace the closed forms, whose differences cancel.
const SMALL_ANGLE_RAD: f64 = 1e-3;

/// Returns the rotation vector of a rotation, the short way round; continuous up to pi.
pub fn log3(rotation: &UnitQuaternion<f64>) -> Vector3<f64> {
    let quaternion = rotation.quaternion();
    let (w, v) = if quaternion.w < 0.0 {
        (-quaternion.w, -quaternion.imag())
    } else {
        (quaternion.w, quaternion.imag())
    };
    let sine = v.norm();
    let scale = if sine < 1e-10 { 2.0 / w } else { 2.0 * sine.atan2(w) / sine };
    v * scale
}

/// Returns the inverse of the left Jacobian of SO(3) at rotation vector `w`:
///   J^-1 = 1 - w^/2 + (1/t^2 - (1 + cos t) / (2 t sin t)) w^ w^,   t = |w|.
pub fn left_jacobian_inverse3(w: &Vector3<f64>) -> Matrix3<f64> {
    let square = w.norm_squared();
    let angle = square.sqrt();
    let factor = if angle < SMALL_ANGLE_RAD {
        1.0 / 12.0 + square / 720.0
    } else {
        1.0 / square - (1.0 + angle.cos()) / (2.0 * angle * angle.sin())
    };
    let cross = w.cross_matrix();
    Matrix3::identity() - cross * 0.5 + cross * cross * factor
}

/// Logarithm of a pose, and the inverse of the left Jacobian of SE(3) there as its two different blocks:
///   J^-1 = [ diagonal  upper ]
///          [ 0         diagonal ]
pub struct Log6 {
    /// Twist [v m; w rad].
    pub twist: Vector6<f64>,
    /// Both diagonal blocks.
    pub diagonal: Matrix3<f64>,
    /// The upper right block.
    pub upper: Matrix3<f64>,
}

impl Log6 {
    /// Computes the logarithm and the blocks at `pose`.
    pub fn of(pose: &Isometry3<f64>) -> Log6 {
        let w = log3(&pose.rotation);
        let diagonal = left_jacobian_inverse3(&w);
        let v = diagonal * pose.translation.vector;
        let upper = -(diagonal * coupling(&v, &w) * diagonal);
        Log6 { twist: Vector6::new(v.x, v.y, v.z, w.x, w.y, w.z), diagonal, upper }
    }

    /// Returns J^-1 times a twist given as its two halves.
    pub fn transform(&self, linear: &Vector3<f64>, angular: &Vector3<f64>) -> Vector6<f64> {
        let top = self.diagonal * linear + self.upper * angular;
        let bottom = self.diagonal * angular;
        Vector6::new(top.x, top.y, top.z, bottom.x, bottom.y, bottom.z)
    }
}

/// Returns the off-diagonal block Q of the left Jacobian of SE(3); Barfoot 2017, equation 7.86.
fn coupling(v: &Vector3<f64>, w: &Vector3<f64>) -> Matrix3<f64> {
    let square = w.norm_squared();
    let t = square.sqrt();
    let (a, b, c) = if t < SMALL_ANGLE_RAD {
        (1.0 / 6.0 - square / 120.0, 1.0 / 24.0 - square / 720.0, 1.0 / 120.0 - square / 2520.0)
    } else {
        let (sin, cos) = t.sin_cos();
        (
            (t - sin) / (square * t),
            (square + 2.0 * cos - 2.0) / (2.0 * square * square),
            (2.0 * t - 3.0 * sin + t * cos) / (2.0 * square * square * t),
        )
    };
    let (vx, wx) = (v.cross_matrix(), w.cross_matrix());
    let (wv, vw) = (wx * vx, vx * wx);
    let wvw = wv * wx;
    vx * 0.5 + (wv + vw + wvw) * a + (wx * wv + vw * wx - wvw * 3.0) * b + (wvw * wx + wx * wvw) * c
}
