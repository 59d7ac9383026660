//! Light: one sun with shadow, a sky that lights from above, a faint lamp at the camera.

use rapier3d::math::Vector;

use super::shadow::ShadowMap;
use crate::render::light::{FROM_ABOVE, FROM_BELOW, HIGHLIGHT, LAMP, SUN, TO_SUN};
use crate::render::rows::LANES;

/// As many points as are shaded together: enough for a loop to be worth its beginning, few enough to stay near the processor.
pub(super) const BATCH: usize = 64;

/// A point that is seen.
#[derive(Clone, Copy)]
pub(super) struct Surface {
    /// In the world, as the directions are.
    pub point_m: Vector,
    /// From the camera to the point; of any length, as the normal is.
    pub ray: Vector,
    pub normal: Vector,
    pub albedo: Vector,
    /// What contacts leave of all light.
    pub open_share: f32,
}

/// Points that are shaded together. They are kept coordinate by coordinate and worked on in loops that do not branch: so
/// several of them are done at once.
pub(super) struct Surfaces {
    count: usize,
    point_m: Vectors,
    ray: Vectors,
    normal: Vectors,
    albedo: Vectors,
    /// Place in the shadow map.
    texel: Vectors,
    /// Light that comes from everywhere, and what the sun adds; and the sun's reflection.
    sun_factor: [f32; BATCH],
    eye_factor: [f32; BATCH],
    highlight_factor: [f32; BATCH],
    sunlit_share: [f32; BATCH],
    open_share: [f32; BATCH],
    colour: Vectors,
}

/// As many vectors as there are points.
struct Vectors([[f32; BATCH]; 3]);

impl Vectors {
    const ZERO: Vectors = Vectors([[0.0; BATCH]; 3]);

    #[inline(always)]
    fn get(&self, i: usize) -> Vector {
        Vector::new(self.0[0][i], self.0[1][i], self.0[2][i])
    }

    #[inline(always)]
    fn set(&mut self, i: usize, value: Vector) {
        (self.0[0][i], self.0[1][i], self.0[2][i]) = (value.x, value.y, value.z);
    }
}

impl Surfaces {
    pub(super) fn new() -> Surfaces {
        Surfaces {
            count: 0,
            point_m: Vectors::ZERO,
            ray: Vectors::ZERO,
            normal: Vectors::ZERO,
            albedo: Vectors::ZERO,
            texel: Vectors::ZERO,
            sun_factor: [0.0; BATCH],
            eye_factor: [0.0; BATCH],
            highlight_factor: [0.0; BATCH],
            sunlit_share: [0.0; BATCH],
            open_share: [1.0; BATCH],
            colour: Vectors::ZERO,
        }
    }

    /// How many more can be pushed.
    pub(super) fn room(&self) -> usize {
        BATCH - self.count
    }

    #[inline(always)]
    pub(super) fn push(&mut self, surface: Surface) {
        // There is room, which the compiler cannot know: so it need not check.
        let i = self.count % BATCH;
        self.count += 1;
        self.point_m.set(i, surface.point_m);
        self.ray.set(i, surface.ray);
        self.normal.set(i, surface.normal);
        self.albedo.set(i, surface.albedo);
        self.open_share[i] = surface.open_share;
    }

    /// Linear colours of all that were pushed, in their order; then they are forgotten.
    #[inline(always)]
    pub(super) fn shade(&mut self, shadow: &ShadowMap) -> impl Iterator<Item = Vector> {
        let count = std::mem::take(&mut self.count);
        let whole = count.next_multiple_of(LANES).min(BATCH);
        for i in 0..whole {
            self.face(i, shadow);
        }
        for i in 0..count {
            self.sunlit_share[i] =
                if self.sun_factor[i] > 0.0 { shadow.sunlit(self.texel.get(i)) } else { 0.0 };
        }
        for i in 0..whole {
            self.light(i);
        }
        (0..count).map(|i| self.colour.get(i))
    }

    /// How a point faces what it is lit by.
    #[inline(always)]
    fn face(&mut self, i: usize, shadow: &ShadowMap) {
        let (ray, normal) = (self.ray.get(i), self.normal.get(i));
        let eye_direction = ray * (-1.0 / ray.length_squared().sqrt());
        let normal = normal * (1.0 / normal.length_squared().sqrt());
        let towards_eye = normal.dot(eye_direction);
        let normal = normal * 1f32.copysign(towards_eye);
        let facing_sun = normal.dot(TO_SUN);
        let half_way = eye_direction + TO_SUN;
        let along = normal.dot(half_way);
        let cosine_2 = along * along / half_way.length_squared();
        let cosine_8 = cosine_2 * cosine_2 * cosine_2 * cosine_2;
        let cosine_40 = cosine_8 * cosine_8 * cosine_8 * cosine_8 * cosine_8;
        self.normal.set(i, normal);
        self.eye_factor[i] = towards_eye.abs();
        self.sun_factor[i] = facing_sun;
        self.highlight_factor[i] = if along > 0.0 { HIGHLIGHT * cosine_40 } else { 0.0 };
        self.texel.set(i, shadow.texel(self.point_m.get(i), normal));
    }

    /// Adds up the light.
    #[inline(always)]
    fn light(&mut self, i: usize) {
        let albedo = self.albedo.get(i);
        let up = self.normal.0[2][i] * 0.5 + 0.5;
        let ambient = FROM_BELOW + (FROM_ABOVE - FROM_BELOW) * up;
        let sunlight = self.sun_factor[i] * self.sunlit_share[i];
        let unlit = albedo * (ambient + LAMP * self.eye_factor[i]);
        self.colour
            .set(i, (unlit + (albedo * SUN + self.highlight_factor[i]) * sunlight) * self.open_share[i]);
    }
}
