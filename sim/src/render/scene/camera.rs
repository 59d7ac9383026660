//! Pinhole cameras, and the cameras of a world: one in each robot's head, and one that sees all robots.

use rapier3d::math::{Pose, Vector};

use super::lens::{CameraModel, Distortion};
use crate::mjcf::MjcfCamera;
use crate::{Step, World};

/// A pinhole camera with square pixels and the principal point in the middle; axes as in
/// [`crate::mjcf::MjcfCamera`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    pub world_from_camera: Pose,
    pub vertical_fov_rad: f32,
    pub width: u32,
    pub height: u32,
    /// Standard deviation of the blur of colours, in pixels. Depth stays sharp.
    pub blur_px: f32,
}

/// Deviation of the camera in a robot's head from the robot's file. The robot itself relies on the file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LensFlaw {
    /// Pose of the actual lens in the nominal camera frame.
    pub camera_from_lens: Pose,
    pub blur_px: f32,
}

/// Intrinsics of an image in the convention of other libraries: the centre of pixel (0, 0) is at (0, 0). A
/// point (x, y, z) in the camera's frame (x right, y down, z forward) is seen at
///
///   u = f x' + cx,   v = f y' + cy,
///
/// with (x', y') from the [`Distortion`]; without distortion they are (x / z, y / z).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    pub width: u32,
    pub height: u32,
    /// Focal length, the same in both directions: pixels are square.
    pub focal_px: f32,
    pub cx: f32,
    pub cy: f32,
    pub distortion: Distortion,
}

impl Intrinsics {
    /// Computes the intrinsics. The optical axis goes through the middle of the image, half a pixel from
    /// the centre of a pixel.
    fn new(vertical_fov_rad: f32, width: u32, height: u32) -> Intrinsics {
        Intrinsics {
            width,
            height,
            focal_px: 0.5 * height as f32 / (0.5 * vertical_fov_rad).tan(),
            cx: 0.5 * width as f32 - 0.5,
            cy: 0.5 * height as f32 - 0.5,
            distortion: Distortion::NONE,
        }
    }

    /// Returns the intrinsics with the lens distortion of a camera model.
    pub fn of_model(self, model: CameraModel) -> Intrinsics {
        let half_height_tan = 0.5 * self.height as f32 / self.focal_px;
        Intrinsics { distortion: model.distortion(half_height_tan), ..self }
    }

    /// Returns the point in the camera's frame, with axes as in [`crate::mjcf::MjcfCamera`], that is
    /// seen at `uv_px` at a depth.
    pub fn unproject(&self, uv_px: [f32; 2], depth_m: f32) -> Vector {
        if self.distortion != Distortion::NONE {
            let place = [(uv_px[0] - self.cx) / self.focal_px, (uv_px[1] - self.cy) / self.focal_px];
            let [x, y] = self.distortion.undistorted(place);
            return Vector::new(x * depth_m, -y * depth_m, -depth_m);
        }
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

/// Distance below which surfaces are not drawn.
pub const NEAR_M: f32 = 0.01;

/// Cameras of one world, as described in its files.
#[derive(Clone, Debug)]
pub struct Cameras {
    /// The camera in each robot's head, by robot.
    heads: Vec<(MjcfCamera, LensFlaw)>,
    third_person: Camera,
    /// Model of the cameras in the heads, and the seed of its noise.
    model: (CameraModel, u32),
}

/// Third-person view for scenes without one: from the side, a little above.
const FALLBACK_EYE_M: Vector = Vector::new(0.4, -2.4, 1.6);
const FALLBACK_TARGET_M: Vector = Vector::new(0.4, 0.0, 0.8);
const THIRD_PERSON: &str = "third_person";

impl LensFlaw {
    /// Lens of a camera that matches its file.
    pub const NONE: LensFlaw = LensFlaw { camera_from_lens: Pose::IDENTITY, blur_px: 0.0 };
}

impl Camera {
    /// Returns the intrinsics of this camera.
    pub fn intrinsics(&self) -> Intrinsics {
        Intrinsics::new(self.vertical_fov_rad, self.width, self.height)
    }

    /// Returns the focal length in pixels, the same in both directions.
    pub fn focal_px(&self) -> f32 {
        self.intrinsics().focal_px
    }

    /// Returns the point where the optical axis meets the image, in pixels from the top left corner.
    pub fn principal_point_px(&self) -> [f32; 2] {
        let Intrinsics { cx, cy, .. } = self.intrinsics();
        [cx + 0.5, cy + 0.5]
    }

    /// Returns the image coordinates (pixels from the top left corner, the first pixel's centre at 0.5,
    /// 0.5) and depth of a point of the world. Returns `None` behind the camera.
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

    /// Returns the point in the camera's frame that is seen at image coordinates `uv_px` at a depth.
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
                blur_px: 0.0,
            },
        };
        let heads = world.robots().iter().map(|robot| (robot.model.egocentric.clone(), LensFlaw::NONE));
        Cameras { heads: heads.collect(), third_person, model: (CameraModel::Ideal, 0) }
    }

    /// Sets the model of the cameras in the robots' heads; `seed` determines its noise.
    pub fn set_model(&mut self, model: CameraModel, seed: u32) {
        self.model = (model, seed);
    }

    /// Returns the model of the cameras in the robots' heads, and the seed of its noise.
    pub fn model(&self) -> (CameraModel, u32) {
        self.model
    }

    /// Returns the deviation of a robot's camera from its file.
    pub fn lens(&self, robot: usize) -> LensFlaw {
        self.heads[robot].1
    }

    /// Returns true if the robots' images are those of ideal cameras.
    pub fn are_ideal(&self) -> bool {
        self.model.0.is_ideal()
    }

    /// Replaces the lens of the camera in the head of robot number `robot`.
    pub fn set_lens(&mut self, robot: usize, lens: LensFlaw) {
        self.heads[robot].1 = lens;
    }

    /// Returns the camera in a robot's head after `step`.
    pub fn egocentric(&self, step: &Step, robot: usize) -> Camera {
        let (head, lens) = &self.heads[robot];
        let world_from_camera = step.robots[robot].truth.world_from_camera;
        match *lens == LensFlaw::NONE {
            true => camera(head, world_from_camera),
            false => {
                Camera { blur_px: lens.blur_px, ..camera(head, world_from_camera * lens.camera_from_lens) }
            }
        }
    }

    /// Returns the scene's camera that sees all robots.
    pub fn third_person(&self) -> Camera {
        self.third_person
    }
}

fn camera(source: &MjcfCamera, world_from_camera: Pose) -> Camera {
    let (width, height) = source.resolution_px;
    Camera { world_from_camera, vertical_fov_rad: source.vertical_fov_rad, width, height, blur_px: 0.0 }
}

fn look_at(eye_m: Vector, target_m: Vector) -> Pose {
    Pose::look_at_rh(eye_m, target_m, Vector::Z).inverse()
}
