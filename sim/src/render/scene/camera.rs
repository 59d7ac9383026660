//! A pinhole camera.

use rapier3d::math::{Pose, Vector};

/// Axes as [`crate::mjcf::MjcfCamera`]'s. Square pixels, principal point in the middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub world_from_camera: Pose,
    pub vertical_fov_rad: f32,
    pub width: u32,
    pub height: u32,
}

/// Nothing nearer than this is drawn.
pub const NEAR_M: f32 = 0.01;

impl Camera {
    /// Focal length in pixels, the same in both directions.
    pub fn focal_px(&self) -> f32 {
        0.5 * self.height as f32 / (0.5 * self.vertical_fov_rad).tan()
    }

    /// Where the optical axis meets the picture, in pixels from the top left corner.
    pub fn principal_point_px(&self) -> [f32; 2] {
        [0.5 * self.width as f32, 0.5 * self.height as f32]
    }

    /// Picture coordinates (pixels from the top left corner, the first pixel's centre at 0.5, 0.5) and depth of a point
    /// of the world; `None` behind the camera.
    pub fn project(&self, point_in_world_m: Vector) -> Option<([f32; 2], f32)> {
        let point = self.world_from_camera.inverse() * point_in_world_m;
        let depth_m = -point.z;
        if depth_m < NEAR_M {
            return None;
        }
        let [cx, cy] = self.principal_point_px();
        let scale = self.focal_px() / depth_m;
        Some(([cx + point.x * scale, cy - point.y * scale], depth_m))
    }

    /// Point in the camera's frame that is seen at picture coordinates `uv_px` at a depth.
    pub fn unproject(&self, uv_px: [f32; 2], depth_m: f32) -> Vector {
        let [cx, cy] = self.principal_point_px();
        let scale = depth_m / self.focal_px();
        Vector::new((uv_px[0] - cx) * scale, (cy - uv_px[1]) * scale, -depth_m)
    }
}
