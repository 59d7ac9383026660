//! Surfaces that a camera sees: one at each pixel's centre, which is lit, and a few around it, for smooth
//! edges.

use rapier3d::math::{Pose, Vector};

use super::scene::{Coat, DIRECT, LAYERS, Scene};
use super::sequence::{PixelSeed, SampleCount};
use super::space::Spot;
use super::space::body::MetSides;
use crate::mjcf::Gloss;
use crate::render::scene::camera::NEAR_M;
use crate::render::shading::baked::cube_light;
use crate::render::shading::lamps::{LitSurface, shown_rgb};
use crate::render::shading::power::blended;
use crate::render::shading::{LAMP, MIN_SEEN_ALPHA, SAMPLES, SKY, VEILS, opacity};
use crate::render::{Camera, Intrinsics, Scenery};

/// Number of sampled points on lamps for each path of a pixel.
const LAMP_POINTS: u32 = 2;
/// Distance from the plane of a surface at which a point belongs to another surface: this share of the
/// distance between both points, plus `MIN_ASIDE_M`.
const ASIDE_SHARE: f32 = 0.15;
const MIN_ASIDE_M: f32 = 0.002;
/// Share of the surfaces facing the rasterisers' sun that it lights.
const SUNLIT_SHARE: f32 = 0.92;
/// Minimum distance between blended surfaces on a ray, as a share of the distance along the ray.
const MIN_STEP_SHARE: f32 = 1e-5;
/// Distance from a mirror at which reflected rays start.
const OFF_MIRROR_M: f32 = 1e-3;
/// Purposes of a pixel's random numbers.
const FOR_LAMPS: u32 = 0;
const FOR_LIGHT: u32 = 1;
const FOR_COAT: u32 = 2;

/// Surface that is visible at a point of the image.
#[derive(Clone, Copy, Default)]
pub struct SeenSurface {
    /// Id in images; 0 for nothing.
    pub id: u32,
    pub point_m: Vector,
    pub normal: Vector,
    pub albedo: Vector,
    /// Colour of its image alone; 1 without an image.
    pub texture_rgb: Vector,
    /// Light from a layer of emission, in addition to the emission of its gloss.
    pub emitted_rgb: Vector,
    pub gloss: Gloss,
    /// Share of the mirror image in its colour.
    pub mirror_share: f32,
}

/// The surface at the centre of a pixel.
#[derive(Clone, Copy, Default)]
pub struct Pixel {
    pub depth_m: f32,
    pub seen: SeenSurface,
    spot: Option<Spot>,
}

/// A camera in a scene.
pub struct PathView<'a> {
    pub scene: &'a Scene<'a>,
    world_from_camera: Pose,
    lens: Intrinsics,
    paths: SampleCount,
}

impl<'a> PathView<'a> {
    /// Places a camera, with this number of paths at each pixel.
    pub fn new(scene: &'a Scene<'a>, camera: &Camera, paths: SampleCount) -> PathView<'a> {
        PathView { scene, world_from_camera: camera.world_from_camera, lens: camera.intrinsics(), paths }
    }

    /// Finds the surfaces at the centres of a row of pixels.
    pub fn look(&self, row: usize, pixels: &mut [Pixel]) {
        for (column, pixel) in pixels.iter_mut().enumerate() {
            let met = self.spot([column as f32, row as f32]);
            *pixel = Pixel {
                depth_m: met.map_or(f32::INFINITY, |(depth_m, _)| depth_m),
                seen: met.map_or(SeenSurface::default(), |(_, spot)| self.seen(&spot)),
                spot: met.map(|(_, spot)| spot),
            };
        }
    }

    /// Finds the surfaces at points that are evenly spread over a pixel, with their places in the image.
    pub fn look_around(&self, row: usize, column: usize) -> [([f32; 2], SeenSurface); SAMPLES * SAMPLES] {
        let at_px = |pixel: usize, i: usize| pixel as f32 + (i as f32 + 0.5) / SAMPLES as f32 - 0.5;
        std::array::from_fn(|i| {
            let uv_px = [at_px(column, i % SAMPLES), at_px(row, i / SAMPLES)];
            let met = self.spot(uv_px);
            (uv_px, met.map_or(SeenSurface::default(), |(_, spot)| self.seen(&spot)))
        })
    }

    /// Returns the colour of the sky at a place in the image.
    pub fn sky_rgb(&self, uv_px: [f32; 2]) -> Vector {
        self.sky_along(self.ray(uv_px))
    }

    fn sky_along(&self, ray: Vector) -> Vector {
        let Some(sky) = &self.scene.prepared.sky else { return SKY };
        let pixel = 1.0 / self.lens.focal_px;
        let steps = [Vector::X * pixel, Vector::NEG_Y * pixel];
        sky.sky_rgb(ray, steps.map(|step| self.world_from_camera.rotation * step))
    }

    /// Returns the colour at a place in the image where blended surfaces are in front of `behind_rgb`. That
    /// colour is seen at the depth `depth_m`.
    pub fn veiled_rgb(&self, uv_px: [f32; 2], behind_rgb: Vector, depth_m: f32) -> Vector {
        let mut rgb = behind_rgb;
        for spot in self.veils(uv_px, depth_m).iter().rev() {
            let part = &self.scene.prepared.scenery.parts[spot.part as usize];
            if !part.is_cut_out() {
                let (_, alpha) = self.scene.albedo_and_alpha(spot, self.pixel_m(spot));
                let own_rgb = self.rasterised_rgb(&self.seen(spot));
                let share = opacity(part.alpha * alpha);
                rgb =
                    Vector::from_array(std::array::from_fn(|axis| blended(rgb[axis], own_rgb[axis], share)));
            }
        }
        rgb
    }

    /// Returns the linear colour of a surface in a rasteriser's image, with the usual share of shadow.
    pub fn rasterised_rgb(&self, seen: &SeenSurface) -> Vector {
        let SeenSurface { point_m, normal, albedo, texture_rgb, emitted_rgb, gloss, .. } = *seen;
        let Scenery { light, lamps, .. } = &self.scene.prepared.scenery;
        let to_eye = (self.eye_m() - point_m).normalize_or_zero();
        if let Some(lamps) = lamps {
            let surface = LitSurface {
                albedo,
                texture_rgb,
                emitted_rgb,
                gloss,
                point_m,
                normal,
                eye_direction: to_eye,
                back_direction: self.back(),
            };
            return shown_rgb(&lamps.headlight, self.scene.lights.stated(), &surface, |_| SUNLIT_SHARE);
        }
        if let (Some(baked), Some(tint)) = (&self.scene.prepared.baked, self.scene.prepared.tint()) {
            let [red, green, blue, _] = cube_light(&baked.cube(point_m), normal.to_array());
            let lit_rgb = albedo * Vector::new(red, green, blue) * Vector::from(tint);
            return (lit_rgb + emitted_rgb).min(Vector::ONE);
        }
        let ambient_rgb = light.below_rgb + (light.above_rgb - light.below_rgb) * (normal.z * 0.5 + 0.5);
        let sun_rgb = light.sun_rgb * (normal.dot(light.sun_direction).max(0.0) * SUNLIT_SHARE);
        let lamp_rgb = Vector::splat(LAMP * to_eye.dot(normal).abs());
        let lit_rgb = albedo * (ambient_rgb * gloss.ambient_factor + lamp_rgb + sun_rgb);
        (lit_rgb + emitted_rgb).min(Vector::ONE)
    }

    /// Returns the colour of a surface with its mirror image. Surfaces in the mirror have the colours of a
    /// rasteriser's image.
    pub fn mirrored_rgb(&self, own_rgb: Vector, seen: &SeenSurface) -> Vector {
        if seen.mirror_share == 0.0 {
            return own_rgb;
        }
        let ray = (seen.point_m - self.eye_m()).normalize();
        let direction = ray - seen.normal * (2.0 * ray.dot(seen.normal));
        let start_m = seen.point_m + seen.normal * OFF_MIRROR_M;
        let mirrored_rgb = match self.scene.space.nearest(start_m, direction, 0.0, MetSides::Front) {
            None => self.sky_along(direction),
            Some((_, hit)) => {
                self.rasterised_rgb(&self.seen(&self.scene.space.spot(start_m, direction, &hit)))
            }
        };
        let blend = |axis: usize| blended(own_rgb[axis], mirrored_rgb[axis], seen.mirror_share);
        Vector::from_array(std::array::from_fn(blend))
    }

    /// Returns the depth of a surface that is seen.
    pub fn depth_m(&self, seen: &SeenSurface) -> f32 {
        if seen.id == 0 { f32::INFINITY } else { (self.eye_m() - seen.point_m).dot(self.back()) }
    }

    /// Returns the blended surfaces at a place in the image up to a depth, the nearest first.
    fn veils(&self, uv_px: [f32; 2], most_m: f32) -> Vec<Spot> {
        let mut found = Vec::new();
        let Some(veils) = &self.scene.veils else { return found };
        let (eye_m, ray) = (self.eye_m(), self.ray(uv_px));
        let mut least_m = NEAR_M;
        while let Some((depth_m, hit)) = veils.nearest(eye_m, ray, least_m, MetSides::Front) {
            if depth_m >= most_m || found.len() == VEILS {
                break;
            }
            found.push(veils.spot(eye_m, ray, &hit));
            least_m = depth_m * (1.0 + MIN_STEP_SHARE);
        }
        found
    }

    /// Computes the light at the centres of a row of pixels.
    pub fn light(&self, row: usize, pixels: &[Pixel], light_rgb: &mut [[Vector; LAYERS]]) {
        for ((column, pixel), layers_rgb) in pixels.iter().enumerate().zip(light_rgb) {
            let Some(spot) = &pixel.spot else { continue };
            let ray = (spot.point_m - self.eye_m()).normalize();
            let seed = PixelSeed::of([column as u32, row as u32]);
            let gloss = &pixel.seen.gloss;
            *layers_rgb = self.scene.lit_layers(spot, Coat::of(gloss), ray, seed, self.paths);
            let headlight_rgb = self.scene.lights.headlight_rgb(spot.normal.dot(self.back()));
            layers_rgb[DIRECT] += headlight_rgb * (1.0 - gloss.metallic_factor);
        }
    }

    /// Returns the position of the camera.
    pub fn eye_m(&self) -> Vector {
        self.world_from_camera.translation
    }

    /// Returns the direction from the camera's target to the camera.
    pub fn back(&self) -> Vector {
        self.world_from_camera.rotation * Vector::Z
    }

    /// Returns the ray of a point of the image, to a depth of 1 m, so that distances along it are depths.
    fn ray(&self, uv_px: [f32; 2]) -> Vector {
        self.world_from_camera.rotation * self.lens.unproject(uv_px, 1.0)
    }

    /// Returns the surface at a point of the image, and its depth. The centre of the first pixel is (0, 0).
    /// Holes that an image's alpha cuts into surfaces are passed.
    pub fn spot(&self, uv_px: [f32; 2]) -> Option<(f32, Spot)> {
        let (eye_m, ray) = (self.eye_m(), self.ray(uv_px));
        let solid = self.scene.space.nearest(eye_m, ray, NEAR_M, MetSides::Front);
        let most_m = solid.as_ref().map_or(f32::INFINITY, |(depth_m, _)| *depth_m);
        let is_seen = |spot: &Spot| {
            let part = &self.scene.prepared.scenery.parts[spot.part as usize];
            part.is_cut_out() && self.scene.albedo_and_alpha(spot, self.pixel_m(spot)).1 >= MIN_SEEN_ALPHA
        };
        let with_relief = |spot: Spot| self.scene.with_relief(spot, -ray, self.pixel_m(&spot));
        if let Some(spot) = self.veils(uv_px, most_m).into_iter().find(is_seen) {
            return Some(((eye_m - spot.point_m).dot(self.back()), with_relief(spot)));
        }
        let (depth_m, hit) = solid?;
        Some((depth_m, with_relief(self.scene.space.spot(eye_m, ray, &hit))))
    }

    /// Returns the width of a pixel at the distance of a surface.
    fn pixel_m(&self, spot: &Spot) -> f32 {
        (spot.point_m - self.eye_m()).length() / self.lens.focal_px
    }

    fn seen(&self, spot: &Spot) -> SeenSurface {
        let albedo = self.scene.albedo(spot, self.pixel_m(spot));
        let (gloss, emitted_rgb) = self.scene.gloss_and_emitted_rgb(spot, self.pixel_m(spot));
        SeenSurface {
            id: self.scene.prepared.scenery.parts[spot.part as usize].id,
            point_m: spot.point_m,
            normal: spot.normal,
            albedo,
            texture_rgb: self.scene.texture_rgb(spot, albedo),
            emitted_rgb,
            gloss,
            mirror_share: self.scene.mirror_share(spot),
        }
    }
}

impl SeenSurface {
    /// Returns the colour in which a surface reflects white light. For metals this is not white.
    pub fn coat_rgb(&self) -> Vector {
        Vector::ONE + (self.albedo - Vector::ONE) * self.gloss.metallic_factor
    }

    /// Returns the likeness of two surfaces: 1 for points of the same surface, less for other surfaces, and 0
    /// for another id.
    pub fn likeness(&self, other: &SeenSurface) -> f32 {
        if self.id != other.id {
            return 0.0;
        }
        let between_m = other.point_m - self.point_m;
        let tolerance_m = between_m.length() * ASIDE_SHARE + MIN_ASIDE_M;
        let aside = (between_m.dot(self.normal).abs() / tolerance_m).min(1.0);
        let turned = self.normal.dot(other.normal).max(0.0);
        let turned_4 = turned * turned * turned * turned;
        (1.0 - aside * aside) * (turned_4 * turned_4) * (turned_4 * turned_4)
    }
}

impl Scene<'_> {
    /// Returns the light at a visible point, layer by layer.
    pub fn lit_layers(
        &self,
        spot: &Spot,
        coat: Coat,
        view_ray: Vector,
        seed: PixelSeed,
        paths: SampleCount,
    ) -> [Vector; LAYERS] {
        let mut layers_rgb = [Vector::ZERO; LAYERS];
        let lamp_points = SampleCount(paths.0 * LAMP_POINTS);
        for sample in 0..lamp_points.0 {
            let pair_values = seed.spread(FOR_LAMPS, sample, lamp_points);
            self.light_directly(spot, coat, view_ray, pair_values, &mut layers_rgb);
        }
        let mut sum_rgb = layers_rgb.map(|rgb| rgb / LAMP_POINTS as f32);
        for sample in 0..paths.0 {
            let pairs = [FOR_LIGHT, FOR_COAT].map(|purpose| seed.spread(purpose, sample, paths));
            let mut numbers = seed.independent(FOR_LIGHT, sample);
            self.light_indirectly(spot, coat, view_ray, pairs, &mut numbers, &mut sum_rgb);
        }
        sum_rgb.map(|rgb| rgb / paths.0 as f32)
    }
}
