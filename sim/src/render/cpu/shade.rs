//! Light: one sun with shadow, a sky that lights from above, a faint lamp at the camera.

use rapier3d::math::Vector;

use super::raster::floor;
use super::shadow::{ShadowMap, TO_SUN};
use crate::render::Pattern;

const SUN: Vector = Vector::new(0.80, 0.77, 0.72);
const FROM_BELOW: Vector = Vector::new(0.20, 0.19, 0.18);
const FROM_ABOVE: Vector = Vector::new(0.40, 0.42, 0.45);
const LAMP: f32 = 0.15;
const HIGHLIGHT: f32 = 0.15;
/// Half the exponent of the cosine: its square needs no root.
const HALF_SHININESS: i32 = 20;
/// Linear.
pub(super) const SKY: Vector = Vector::new(0.45, 0.55, 0.70);
const CHECKER_DARK: f32 = 0.72;
const CHECKER_PER_M: f32 = 2.0;

/// A point that is seen.
pub(super) struct Surface {
    /// In the world, as the directions are.
    pub point_m: Vector,
    pub normal: Vector,
    pub eye_direction: Vector,
    pub albedo: Vector,
}

impl Surface {
    /// Linear colour.
    #[inline]
    pub(super) fn shade(&self, shadow: &ShadowMap) -> Vector {
        let towards_eye = self.normal.dot(self.eye_direction);
        let (normal, facing_eye) = (self.normal * 1f32.copysign(towards_eye), towards_eye.abs());
        let ambient = FROM_BELOW.lerp(FROM_ABOVE, normal.z * 0.5 + 0.5);
        let unlit = self.albedo * (ambient + LAMP * facing_eye);
        let facing_sun = normal.dot(TO_SUN);
        if facing_sun <= 0.0 {
            return unlit;
        }
        let sunlight = facing_sun * shadow.sunlit(self.point_m, normal);
        let half_way = self.eye_direction + TO_SUN;
        let along = normal.dot(half_way).max(0.0);
        let cosine_squared = along * along / half_way.length_squared();
        let highlight = HIGHLIGHT * cosine_squared.powi(HALF_SHININESS);
        unlit + (self.albedo * SUN + highlight) * sunlight
    }
}

/// Linear colour of a part's surface at a point of the world.
pub(super) fn albedo(pattern: Pattern, linear_rgb: Vector, point_m: Vector) -> Vector {
    match pattern {
        Pattern::Plain => linear_rgb,
        Pattern::Checker => {
            let square = |metres: f32| floor(f64::from(metres * CHECKER_PER_M));
            let dark = (square(point_m.x) + square(point_m.y)) & 1 == 0;
            if dark { linear_rgb * CHECKER_DARK } else { linear_rgb }
        }
    }
}
