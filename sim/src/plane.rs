//! The horizontal plane: where things stand on it and which way they face.

use std::f32::consts::{PI, TAU};

use rapier3d::math::{Pose, Vector};

/// Which way the x axis of a pose points, seen from above: 0 along the world's x axis, counter-clockwise positive.
pub fn heading_rad(pose: &Pose) -> f32 {
    let forward = pose.rotation * Vector::X;
    forward.y.atan2(forward.x)
}

/// The same angle within half a turn of zero.
pub fn wrapped_rad(angle_rad: f32) -> f32 {
    (angle_rad + PI).rem_euclid(TAU) - PI
}

/// The horizontal part of a vector.
pub(crate) fn flat(Vector { x, y, .. }: Vector) -> Vector {
    Vector::new(x, y, 0.0)
}
