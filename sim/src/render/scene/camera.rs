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

/// What a picture's pixels mean, without distortion, as other libraries count: the centre of pixel (0, 0) lies at (0, 0), so a
/// point (x, y, z) in the camera's frame (x right, y down, z forward) is seen at
///
///   u = f x / z + cx,   v = f y / z + cy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    pub width: u32,
    pub height: u32,
    /// The same in both directions: pixels are square.
    pub focal_px: f32,
    pub cx: f32,
    pub cy: f32,
}

impl Intrinsics {
    /// The optical axis goes through the middle of the picture, which lies half a pixel from the centre of a pixel.
    fn new(vertical_fov_rad: f32, width: u32, height: u32) -> Intrinsics {
        Intrinsics {
            width,
            height,
            focal_px: 0.5 * height as f32 / (0.5 * vertical_fov_rad).tan(),
            cx: 0.5 * width as f32 - 0.5,
            cy: 0.5 * height as f32 - 0.5,
        }
    }

    /// Point in the camera's frame, with its axes as [`crate::mjcf::MjcfCamera`]'s, that is seen at `uv_px` at a depth.
    pub fn unproject(&self, uv_px: [f32; 2], depth_m: f32) -> Vector {
        let scale = depth_m / self.focal_px;
        Vector::new((uv_px[0] - self.cx) * scale, (self.cy - uv_px[1]) * scale, -depth_m)
    }
}

impl From<&MjcfCamera> for Intrinsics {
    fn from(camera: &MjcfCamera) -> Intrinsics {
        let (width, height) = camera.resolution_px;
        Intrinsics::new(camera.vertical_fov_rad, width, height)
    }
}

/// Nothing nearer than this is drawn.
pub const NEAR_M: f32 = 0.01;

/// Cameras of one world, as its files describe them.
#[derive(Clone, Debug)]
pub struct Cameras {
    /// The camera in each robot's head, by robot.
    heads: Vec<MjcfCamera>,
    third_person: Camera,
}

/// Third-person view where a scene's file gives none: from the side, a little above.
const FALLBACK_EYE_M: Vector = Vector::new(0.4, -2.4, 1.6);
const FALLBACK_TARGET_M: Vector = Vector::new(0.4, 0.0, 0.8);
const THIRD_PERSON: &str = "third_person";

impl Camera {
    /// What this camera's pixels mean to others.
    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics::new(self.vertical_fov_rad, self.width, self.height)
    }

    /// Focal length in pixels, the same in both directions.
    pub fn focal_px(&self) -> f32 {
        self.intrinsics().focal_px
    }

    /// Where the optical axis meets the picture, in pixels from the top left corner.
    pub fn principal_point_px(&self) -> [f32; 2] {
        let Intrinsics { cx, cy, .. } = self.intrinsics();
        [cx + 0.5, cy + 0.5]
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
        self.intrinsics().unproject(uv_px.map(|px| px - 0.5), depth_m)
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
        camera(&self.heads[robot], step.robots[robot].truth.world_from_camera)
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
