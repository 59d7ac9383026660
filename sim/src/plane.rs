//! The horizontal plane: positions and headings.

use std::f32::consts::{PI, TAU};

use rapier3d::math::{Pose, Vector};

/// Returns the direction of the x axis of a pose, seen from above: 0 along the world's x axis,
/// counter-clockwise positive.
pub fn heading_rad(pose: &Pose) -> f32 {
    let forward = pose.rotation * Vector::X;
    forward.y.atan2(forward.x)
}

/// Returns the equivalent angle within half a turn of zero.
pub fn wrapped_rad(angle_rad: f32) -> f32 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// Returns the horizontal part of a vector.
pub fn flat(Vector { x, y, .. }: Vector) -> Vector {
    Vector::new(x, y, 0.0)
}
