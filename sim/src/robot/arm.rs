//! What an arm tells of its hand at one instant.

use crate::body::ARM_JOINTS;

/// One arm at one instant.
pub(super) struct Arm {
    /// Torque of each joint per newton at the palm along world x, y, z: the rows of J.
    pub levers_m: [[f32; ARM_JOINTS]; 3],
    /// Torques of the drives beyond those that hold the arm against gravity.
    pub excess_n_m: [f32; ARM_JOINTS],
}
