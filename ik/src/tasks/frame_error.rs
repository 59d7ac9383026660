//! How far a frame is from where it should be.

use nalgebra::Isometry3;

/// What a frame is away from its target.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameError {
    /// Distance of the origins, m.
    pub position_m: f64,
    /// Angle between the orientations, rad.
    pub orientation_rad: f64,
}

impl FrameError {
    pub(super) fn of(missing: &Isometry3<f64>, [position_cost, orientation_cost]: [f64; 2]) -> FrameError {
        FrameError {
            position_m: if position_cost > 0.0 { missing.translation.vector.norm() } else { 0.0 },
            orientation_rad: if orientation_cost > 0.0 { missing.rotation.angle() } else { 0.0 },
        }
    }

    /// Squared, metres and radians alike.
    pub(crate) fn squared(&self) -> f64 {
        self.position_m.powi(2) + self.orientation_rad.powi(2)
    }
}

/// What one step of a whole solution takes on: far targets do not upset near joints.
pub(crate) const ERROR_CLAMP: FrameError = FrameError { position_m: 0.3, orientation_rad: 0.9 };
