//! Pinhole cameras, and those of a world: one in each robot's head, one that sees all robots.

use rapier3d::math::{Pose, Vector};

use crate::mjcf::MjcfCamera;
use crate::{Step, World};

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

/// Cameras of one world, as its files describe them.
#[derive(Clone, Debug)]
pub struct Cameras {
    /// By robot.
    heads: Vec<MjcfCamera>,
    third_person: Camera,
}

/// Third-person view where a scene's file gives none: from the side, a little above.
const FALLBACK_EYE_M: Vector = Vector::new(0.4, -2.4, 1.6);
const FALLBACK_TARGET_M: Vector = Vector::new(0.4, 0.0, 0.8);
const THIRD_PERSON: &str = "third_person";

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

impl Cameras {
    pub fn of(world: &World) -> Cameras {
        let third_person = match world.cameras().iter().find(|camera| camera.name == THIRD_PERSON) {
            Some(found) => camera(found, found.body_from_camera),
            None => Camera {
                world_from_camera: look_at(FALLBACK_EYE_M, FALLBACK_TARGET_M),
                vertical_fov_rad: 50f32.to_radians(),
                width: 640,
                height: 480,
            },
        };
        let heads = world.robots().iter().map(|robot| robot.model.egocentric.clone()).collect();
        Cameras { heads, third_person }
    }

    /// The camera in a robot's head, as `step` left it.
    pub fn egocentric(&self, step: &Step, robot: usize) -> Camera {
        let state = &step.robots[robot].state;
        camera(&self.heads[robot], state.world_from_pelvis * state.pelvis_from_camera)
    }

    /// The scene's camera that sees all robots.
    pub fn third_person(&self) -> Camera {
        self.third_person
    }
}

fn camera(source: &MjcfCamera, world_from_camera: Pose) -> Camera {
    let (width, height) = source.resolution_px;
    Camera { world_from_camera, vertical_fov_rad: source.vertical_fov_rad, width, height }
}

fn look_at(eye_m: Vector, target_m: Vector) -> Pose {
    Pose::look_at_rh(eye_m, target_m, Vector::Z).inverse()
}
