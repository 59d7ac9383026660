//! Models of cameras, and the distortion of their lenses after Brown and Conrady.

use serde::{Deserialize, Serialize};

/// Model of the cameras in the robots' heads.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum CameraModel {
    /// A pinhole with a perfect sensor.
    #[default]
    Ideal,
    /// The colour sensor and the stereo depth of an Intel RealSense D435i, the head camera of the G1.
    D435i,
}

impl CameraModel {
    pub const ALL: [CameraModel; 2] = [CameraModel::Ideal, CameraModel::D435i];

    pub fn name(self) -> &'static str {
        match self {
            CameraModel::Ideal => "ideal",
            CameraModel::D435i => "d435i",
        }
    }

    /// Returns true for the default, which serialised specs omit.
    pub fn is_ideal(&self) -> bool {
        *self == CameraModel::Ideal
    }

    /// Returns the lens distortion of the model; `half_height_tan` is the tangent of half the vertical field
    /// of view.
    pub fn distortion(self, half_height_tan: f32) -> Distortion {
        match self {
            CameraModel::Ideal => Distortion::NONE,
            CameraModel::D435i => Distortion::d435i(half_height_tan),
        }
    }
}

/// Coefficients of the distortion of an image, in OpenCV's form. The ray through (x, y, 1), x right and y
/// down, is seen at
///
///   x' = x (1 + k1 r^2 + k2 r^4) + 2 p1 x y + p2 (r^2 + 2 x^2),
///   y' = y (1 + k1 r^2 + k2 r^4) + p1 (r^2 + 2 y^2) + 2 p2 x y,   r^2 = x^2 + y^2.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Distortion {
    pub k1: f32,
    pub k2: f32,
    pub p1: f32,
    pub p2: f32,
}

/// Published calibration of a D435i's colour images at 640x480, from the file `realsense_color_config.yaml`
/// of VINS-Mono and related projects. The distortion shifts the image's edge by 1.2 %; Intel's datasheet
/// states at most 1.5 %.
const D435I: Distortion =
    Distortion { k1: 0.092_615_5, k2: -0.180_824_39, p1: -6.548_41e-4, p2: -3.582_935e-4 };
/// Tangent of half the vertical field of view of that calibration: 240 pixels over a focal length of 609.1.
const D435I_HALF_HEIGHT: f32 = 240.0 / 609.095_8;

/// Number of iterations that invert the distortion. Each divides the error by more than thirty.
const ITERATIONS: usize = 3;

impl Distortion {
    /// Lens without distortion.
    pub const NONE: Distortion = Distortion { k1: 0.0, k2: 0.0, p1: 0.0, p2: 0.0 };

    /// Returns a D435i's distortion for a lens with another vertical field of view. A point is shifted by the
    /// same share of the image's height as with a D435i's own lens.
    fn d435i(half_height_tan: f32) -> Distortion {
        let scale = D435I_HALF_HEIGHT / half_height_tan;
        let squared = scale * scale;
        let Distortion { k1, k2, p1, p2 } = D435I;
        Distortion { k1: k1 * squared, k2: k2 * squared * squared, p1: p1 * scale, p2: p2 * scale }
    }

    /// Returns the factor of the radial distortion, and the shift of the tangential distortion.
    #[inline(always)]
    fn shift(&self, [x, y]: [f32; 2]) -> (f32, [f32; 2]) {
        let (xx, xy, yy) = (x * x, x * y, y * y);
        let rr = xx + yy;
        let outwards = 1.0 + rr * (self.k1 + rr * self.k2);
        let aside =
            [2.0 * self.p1 * xy + self.p2 * (rr + 2.0 * xx), self.p1 * (rr + 2.0 * yy) + 2.0 * self.p2 * xy];
        (outwards, aside)
    }

    /// Returns the distorted image coordinates of a ray.
    pub fn distorted(&self, ray: [f32; 2]) -> [f32; 2] {
        let (outwards, aside) = self.shift(ray);
        [ray[0] * outwards + aside[0], ray[1] * outwards + aside[1]]
    }

    /// Returns the ray that is seen at the distorted image coordinates `distorted_ray`.
    #[inline(always)]
    pub fn undistorted(&self, distorted_ray: [f32; 2]) -> [f32; 2] {
        let mut ray = distorted_ray;
        for _ in 0..ITERATIONS {
            let (outwards, aside) = self.shift(ray);
            ray = [(distorted_ray[0] - aside[0]) / outwards, (distorted_ray[1] - aside[1]) / outwards];
        }
        ray
    }
}
