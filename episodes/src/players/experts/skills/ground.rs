//! Places on the floor: where robots stand, and which way they look.

use std::f32::consts::PI;

use tandem_sim::{Pose, Rotation, Vector};

/// The heading of a frame: which way its x axis points, seen from above.
pub fn heading_rad(pose: &Pose) -> f32 {
    let x = pose.rotation * Vector::X;
    x.y.atan2(x.x)
}

/// An angle from -pi to pi.
pub fn wrapped_rad(angle_rad: f32) -> f32 {
    (angle_rad + PI).rem_euclid(2.0 * PI) - PI
}

/// The same place and heading, without any tilt.
pub fn upright(pose: &Pose) -> Pose {
    Pose::from_parts(pose.translation, Rotation::from_rotation_z(heading_rad(pose)))
}

/// A place and a heading.
pub fn place(position_m: Vector, heading_rad: f32) -> Pose {
    Pose::from_parts(position_m, Rotation::from_rotation_z(heading_rad))
}
