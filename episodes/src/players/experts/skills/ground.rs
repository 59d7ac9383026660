//! Places on the floor: where robots stand, and which way they look.

use tandem_sim::{Pose, Rotation, Vector, heading_rad};

/// The same place and heading, without any tilt.
pub fn upright(pose: &Pose) -> Pose {
    Pose::from_parts(pose.translation, Rotation::from_rotation_z(heading_rad(pose)))
}

/// A place and a heading.
pub fn place(position_m: Vector, heading_rad: f32) -> Pose {
    Pose::from_parts(position_m, Rotation::from_rotation_z(heading_rad))
}
