//! Rays of an image's samples.

use rapier3d::math::Vector;

use crate::render::Camera;
use crate::render::shading::SAMPLES;

/// Origin and rays of an image's samples, world frame. Rays extend to a depth of 1 m.
pub struct Rays {
    pub eye_m: Vector,
    /// The ray through the first sample, and the steps to the next sample to the right and down.
    pub first_ray: Vector,
    pub right_ray: Vector,
    pub down_ray: Vector,
    /// Direction from the camera's target to the camera.
    pub back_direction: Vector,
}

impl Rays {
    pub fn new(camera: &Camera) -> Rays {
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        let (right, down) = (rotation * Vector::X * sample, rotation * Vector::NEG_Y * sample);
        Rays {
            eye_m: camera.world_from_camera.translation,
            first_ray: rotation * camera.unproject([0.0, 0.0], 1.0) + (right + down) * 0.5,
            right_ray: right,
            down_ray: down,
            back_direction: rotation * Vector::Z,
        }
    }

    /// Returns the ray of a sample, and the steps to the next pixels to the right and down.
    #[inline(always)]
    pub fn sample(&self, [x, y]: [usize; 2]) -> (Vector, [Vector; 2]) {
        let ray = self.first_ray + self.right_ray * x as f32 + self.down_ray * y as f32;
        (ray, [self.right_ray * SAMPLES as f32, self.down_ray * SAMPLES as f32])
    }

    /// Returns the point that is seen at the centre of a pixel.
    pub fn point_m(&self, [x, y]: [usize; 2], nearness_1_m: f32) -> Vector {
        let (ray, _) = self.sample([x * SAMPLES, y * SAMPLES]);
        self.eye_m + (ray + (self.right_ray + self.down_ray) * 0.5) / nearness_1_m
    }
}
