//! Motion of a camera, and the resulting motion of its image.

use rapier3d::math::{Pose, Vector};

use crate::CONTROL_DT_S;

/// Velocity of a camera in its own frame, with axes as in [`crate::mjcf::MjcfCamera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraMotion {
    pub linear_m_s: Vector,
    pub angular_rad_s: Vector,
}

impl CameraMotion {
    /// Motion of a camera at rest.
    pub const STILL: CameraMotion = CameraMotion { linear_m_s: Vector::ZERO, angular_rad_s: Vector::ZERO };

    /// Returns the mean motion in the control step between two poses.
    pub fn between(world_from_before: &Pose, world_from_after: &Pose) -> CameraMotion {
        let before_from_after = world_from_before.inverse() * *world_from_after;
        let turn = before_from_after.rotation;
        CameraMotion {
            // The motion is in the frame after the step, like the image.
            linear_m_s: turn.inverse() * before_from_after.translation / CONTROL_DT_S,
            angular_rad_s: turn.to_scaled_axis() / CONTROL_DT_S,
        }
    }

    /// Returns the velocity, relative to the focal length, at which the pixel of the ray `(x, y, 1)` moves
    /// over the image of a static world. Here x is right and y down. The velocity is minus the optical flow
    /// of Longuet-Higgins and Prazdny 1980:
    ///
    ///   dx/dt = (vx - x vz) / z + wy (1 + x^2) - wz y - wx x y,
    ///   dy/dt = (vy - y vz) / z - wx (1 + y^2) + wz x + wy x y.
    #[inline(always)]
    pub(super) fn flow(&self, [x, y]: [f32; 2], inverse_depth_1_m: f32) -> [f32; 2] {
        // This converts from the axes of MJCF (y up, z back) to those of the image (y down, z forward).
        let [vx, vy, vz] = [self.linear_m_s.x, -self.linear_m_s.y, -self.linear_m_s.z];
        let [wx, wy, wz] = [self.angular_rad_s.x, -self.angular_rad_s.y, -self.angular_rad_s.z];
        let xy = x * y;
        [
            (vx - x * vz) * inverse_depth_1_m + wy * (1.0 + x * x) - wz * y - wx * xy,
            (vy - y * vz) * inverse_depth_1_m - wx * (1.0 + y * y) + wz * x + wy * xy,
        ]
    }
}
