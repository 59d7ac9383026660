//! Light of a file's lamps in one state, with their shadows.

use pulp::Simd;
use rapier3d::math::Vector;

use super::raster::whole_f32;
use super::shade::{Surfaces, dot};
use super::shadow::ShadowMap;
use super::target::{RenderTarget, draw_casting};
use crate::mjcf::{FileLight, Headlight, LightKind, SHININESS};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::lamps::{LAMP_BIAS_SHARE, LAMP_NORMAL_TEXELS, lamp_map, lamp_view, tilted};
use crate::render::shading::lanes::{Affine, LANES, Lanes, axes, lanes};
use crate::render::shading::power::{file_value, linear_value, power};
use crate::render::shading::{SAMPLES, TEXELS};
use crate::render::{Camera, Lamps, PlacedScenery};

/// The lamps of a state.
#[derive(Default)]
pub(super) struct LitLamps {
    headlight: Headlight,
    lamps: Vec<LitLamp>,
}

struct LitLamp {
    light: FileLight,
    shadow: LampShadow,
}

enum LampShadow {
    None,
    Sun(Box<ShadowMap>),
    Cone(Box<ConeShadow>),
}

/// Shadow map of a spot or a point light: the surfaces that it shines on.
struct ConeShadow {
    seen: RenderTarget,
    map: Affine,
    /// Width of a texel at a distance of 1 m.
    texel_m: f32,
}

/// Sums of the light on several points, in file values (sRGB).
struct Sums {
    normal: [Lanes; 3],
    to_eye: [Lanes; 3],
    /// Specular strength of the surface, and exponent of its highlights.
    gloss: [Lanes; 2],
    /// Share of ambient light that reaches the surface.
    ambient: Lanes,
    lit: [Lanes; 3],
    glossy: [Lanes; 3],
}

/// Colours of points in file values (sRGB): `own` is the material times the texture. The upper limit `most`
/// is the texture alone, 1 without a texture.
struct LitColours {
    own: [Lanes; 3],
    most: [Lanes; 3],
    metallic: Lanes,
}

impl LitLamps {
    pub(super) fn forget(&mut self) {
        self.lamps.clear();
    }

    /// Places the lamps of a state and draws their shadows.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        lamps: &Lamps,
        prepared: &Prepared,
        placed: &PlacedScenery,
    ) {
        self.headlight = lamps.headlight;
        let mut before = std::mem::take(&mut self.lamps).into_iter().map(|lamp| lamp.shadow);
        for light in &placed.lights {
            let shadow = before.next().unwrap_or(LampShadow::None);
            let shadow = match light.kind {
                _ if !light.casts_shadow => LampShadow::None,
                LightKind::Directional => {
                    let mut map = match shadow {
                        LampShadow::Sun(map) => map,
                        LampShadow::None | LampShadow::Cone(_) => Box::default(),
                    };
                    map.draw(simd, prepared, placed, tilted(-light.direction));
                    LampShadow::Sun(map)
                }
                LightKind::Spot | LightKind::Point => {
                    let mut seen = match shadow {
                        LampShadow::Cone(cone) => cone.seen,
                        LampShadow::None | LampShadow::Sun(_) => RenderTarget::default(),
                    };
                    let side = (TEXELS / SAMPLES) as u32;
                    let (world_from_camera, vertical_fov_rad) = lamp_view(light);
                    let camera = Camera {
                        world_from_camera,
                        vertical_fov_rad,
                        width: side,
                        height: side,
                        blur_px: 0.0,
                    };
                    draw_casting(simd, &mut seen, prepared, placed, &camera);
                    let texel_m = 2.0 * (0.5 * vertical_fov_rad).tan() / TEXELS as f32;
                    LampShadow::Cone(Box::new(ConeShadow { seen, map: lamp_map(light), texel_m }))
                }
            };
            self.lamps.push(LitLamp { light: *light, shadow });
        }
    }
}

impl Surfaces {
    /// Adds the colours of all points like [`Surfaces::shade`], in the light of lamps. `back_direction` is
    /// the direction from the camera's target to the camera.
    #[inline(always)]
    pub(super) fn shade_by_lamps(
        &mut self,
        lamps: &LitLamps,
        back_direction: Vector,
        sum_rgb: &mut [Vec<f32>; 3],
    ) {
        let count = self.take_count();
        for at in (0..count).step_by(LANES) {
            let colours = self.lit_by_lamps(at, count, lamps, back_direction);
            for (sum, colours) in sum_rgb.iter_mut().zip(&colours) {
                for (pixel, colour) in self.pixels[at..].iter().zip(colours).take(count - at) {
                    sum[*pixel as usize] += colour;
                }
            }
        }
    }

    /// Returns the total light of a block, weighted by the points' shares.
    #[inline(always)]
    fn lit_by_lamps(&self, at: usize, count: usize, lamps: &LitLamps, back_direction: Vector) -> [Lanes; 3] {
        let point_m = self.point_m.block(at);
        let [emission, specular, shininess] = self.gloss.block(at);
        let (albedo, texture) = (self.albedo.block(at), self.texture.block(at));
        let surface = LitColours {
            own: axes(
                #[inline(always)]
                |axis| lanes(|i| file_value(albedo[axis][i])),
            ),
            most: axes(
                #[inline(always)]
                |axis| lanes(|i| file_value(texture[axis][i])),
            ),
            metallic: self.metallic(at),
        };
        let layers = self.has_layers.then(|| self.layers(at));
        let ambient = layers.map_or([1.0; LANES], |(ambient, _)| ambient);
        let mut sums = self.unlit(at, [specular, shininess], ambient);
        sums.lit = [emission; 3];
        sums.add_headlight(&lamps.headlight, back_direction);
        let casts_shadow = |lamp: &&LitLamp| !matches!(lamp.shadow, LampShadow::None);
        for lamp in lamps.lamps.iter().filter(|lamp| !casts_shadow(lamp)) {
            sums.add(lamp, &point_m, count - at);
        }
        let mut values = [[0.0; LANES]; 3];
        sums.show(&surface, &mut values);
        // MuJoCo limits the light of each lamp with shadows separately.
        for lamp in lamps.lamps.iter().filter(casts_shadow) {
            sums.add(lamp, &point_m, count - at);
            sums.show(&surface, &mut values);
        }
        if let Some((_, emitted)) = &layers {
            for (values, emitted) in values.iter_mut().zip(emitted) {
                *values = lanes(|i| values[i] + file_value(emitted[i]));
            }
        }
        let shares = self.shares(at);
        axes(
            #[inline(always)]
            |axis| {
                lanes(|i| {
                    let value = values[axis][i];
                    linear_value(if value < 1.0 { value } else { 1.0 }) * shares[i]
                })
            },
        )
    }

    /// Returns sums with the orientation of points, and no light yet.
    #[inline(always)]
    fn unlit(&self, at: usize, [specular, shininess]: [Lanes; 2], ambient: Lanes) -> Sums {
        let (ray, normal) = (self.ray.block(at), self.normal.block(at));
        let per_ray: Lanes = lanes(|i| -1.0 / dot(&ray, &ray, i).sqrt());
        let per_normal: Lanes = lanes(|i| 1.0 / dot(&normal, &normal, i).sqrt());
        let outwards: Lanes =
            lanes(|i| per_normal[i].copysign(dot(&normal, &ray, i) * per_ray[i] * per_normal[i]));
        Sums {
            normal: axes(
                #[inline(always)]
                |axis| lanes(|i| normal[axis][i] * outwards[i]),
            ),
            to_eye: axes(
                #[inline(always)]
                |axis| lanes(|i| ray[axis][i] * per_ray[i]),
            ),
            gloss: [specular, lanes(|i| shininess[i] * SHININESS)],
            ambient,
            lit: [[0.0; LANES]; 3],
            glossy: [[0.0; LANES]; 3],
        }
    }
}

impl Sums {
    /// Adds the surfaces' colours in the summed light, and clears the light. The light, highlights included,
    /// is limited before an image multiplies it.
    #[inline(always)]
    fn show(&mut self, surface: &LitColours, values: &mut [Lanes; 3]) {
        for (axis, sum) in values.iter_mut().enumerate() {
            let (own, most) = (&surface.own[axis], &surface.most[axis]);
            let (lit, glossy) = (&self.lit[axis], &self.glossy[axis]);
            *sum = lanes(|i| {
                let tint = most[i] + (own[i] - most[i]) * surface.metallic[i];
                let value = own[i] * lit[i] + glossy[i] * tint;
                sum[i] + if value < most[i] { value } else { most[i] }
            });
        }
        (self.lit, self.glossy) = ([[0.0; LANES]; 3], [[0.0; LANES]; 3]);
    }

    #[inline(always)]
    fn add_headlight(&mut self, headlight: &Headlight, back_direction: Vector) {
        let towards: [Lanes; 3] = axes(|axis| [back_direction[axis]; LANES]);
        let Headlight { ambient_rgb, diffuse_rgb, specular_rgb } = *headlight;
        self.add_light([ambient_rgb, diffuse_rgb, specular_rgb], &towards, &[1.0; LANES]);
    }

    /// Adds the light of a lamp at the first `count` points.
    #[inline(always)]
    fn add(&mut self, LitLamp { light, shadow }: &LitLamp, point_m: &[Lanes; 3], count: usize) {
        let colours_rgb = [light.ambient_rgb, light.diffuse_rgb, light.specular_rgb];
        let (towards, mut share) = arriving(light, point_m);
        for (i, share) in share.iter_mut().enumerate().take(count) {
            if *share <= 0.0 || matches!(shadow, LampShadow::None) {
                continue;
            }
            // A surface that faces away from a lamp receives only its ambient light.
            if dot(&self.normal, &towards, i) <= 0.0 && light.ambient_rgb == Vector::ZERO {
                continue;
            }
            let here = |vectors: &[Lanes; 3]| Vector::new(vectors[0][i], vectors[1][i], vectors[2][i]);
            *share *= shadow.sunlit(here(point_m), here(&self.normal));
        }
        self.add_light(colours_rgb, &towards, &share);
    }

    /// Adds ambient, diffuse and specular light from a direction.
    #[inline(always)]
    fn add_light(&mut self, [dim, diffuse, specular]: [Vector; 3], towards: &[Lanes; 3], share: &Lanes) {
        let half_way: [Lanes; 3] = axes(
            #[inline(always)]
            |axis| lanes(|i| towards[axis][i] + self.to_eye[axis][i]),
        );
        let facing: Lanes = lanes(|i| dot(&self.normal, towards, i));
        let shine: Lanes = lanes(|i| {
            let length = dot(&half_way, &half_way, i).sqrt();
            let along = dot(&self.normal, &half_way, i) / if length > 1e-6 { length } else { 1e-6 };
            let shine = self.gloss[0][i] * power(if along > 0.0 { along } else { 0.0 }, self.gloss[1][i]);
            if facing[i] > 0.0 { shine * share[i] } else { 0.0 }
        });
        for axis in 0..3 {
            let lit: Lanes = lanes(|i| {
                let facing = if facing[i] > 0.0 { facing[i] } else { 0.0 };
                self.lit[axis][i] + (dim[axis] * self.ambient[i] + diffuse[axis] * facing) * share[i]
            });
            let glossy: Lanes = lanes(|i| self.glossy[axis][i] + specular[axis] * shine[i]);
            (self.lit[axis], self.glossy[axis]) = (lit, glossy);
        }
    }
}

/// Returns the directions to a light, and the shares of its light that reach the points without shadows, like
/// [`arriving`](crate::render::shading::lamps::arriving).
#[inline(always)]
fn arriving(light: &FileLight, point_m: &[Lanes; 3]) -> ([Lanes; 3], Lanes) {
    let direction = light.direction;
    if light.kind == LightKind::Directional {
        return (axes(|axis| [-direction[axis]; LANES]), [1.0; LANES]);
    }
    let towards_m: [Lanes; 3] = axes(
        #[inline(always)]
        |axis| lanes(|i| light.position_m[axis] - point_m[axis][i]),
    );
    let distance_m: Lanes = lanes(|i| dot(&towards_m, &towards_m, i).sqrt() + 1e-6);
    let towards: [Lanes; 3] = axes(
        #[inline(always)]
        |axis| lanes(|i| towards_m[axis][i] / distance_m[i]),
    );
    let [constant, linear, square] = light.attenuation_values;
    let share: Lanes = lanes(|i| {
        let fall = constant + linear * distance_m[i] + square * distance_m[i] * distance_m[i];
        1.0 / if fall > 1e-6 { fall } else { 1e-6 }
    });
    if light.kind == LightKind::Point {
        return (towards, share);
    }
    let least_cosine = light.cutoff_rad.cos();
    let along: Lanes =
        lanes(|i| -(towards[0][i] * direction.x + towards[1][i] * direction.y + towards[2][i] * direction.z));
    let share = lanes(|i| {
        let cone = power(if along[i] > 0.0 { along[i] } else { 0.0 }, light.exponent_value);
        if along[i] < least_cosine { 0.0 } else { share[i] * cone }
    });
    (towards, share)
}

impl LampShadow {
    /// Returns 1 in the light, 0 in the shadow.
    #[inline(always)]
    fn sunlit(&self, point_m: Vector, normal: Vector) -> f32 {
        match self {
            LampShadow::None => 1.0,
            LampShadow::Sun(map) => map.sunlit_at(point_m, normal),
            LampShadow::Cone(cone) => cone.sunlit(point_m, normal),
        }
    }
}

impl ConeShadow {
    /// Filters bilinearly over three texels, like the sun's shadow map.
    fn sunlit(&self, point_m: Vector, normal: Vector) -> f32 {
        let [_, _, distance_m] = self.map.map(point_m);
        let offset_m = LAMP_NORMAL_TEXELS * self.texel_m * distance_m.max(0.0);
        let [u, v, depth_m] = self.map.map(point_m + normal * offset_m);
        if depth_m <= 0.0 {
            return 1.0;
        }
        let (u, v) = (u / depth_m - 0.5, v / depth_m - 0.5);
        let inside = 1.0..(TEXELS - 3) as f32;
        if !inside.contains(&u) || !inside.contains(&v) {
            return 1.0;
        }
        let nearer_m = depth_m * (1.0 - LAMP_BIAS_SHARE);
        let (column, row) = (whole_f32(u.floor()) as usize, whole_f32(v.floor()) as usize);
        let weights = |part: f32| [1.0 - part, 1.0, 1.0, part];
        let (across, down) = (weights(u - u.floor()), weights(v - v.floor()));
        let mut lit = 0.0;
        for (y, down) in down.into_iter().enumerate() {
            let occluders_1_m = &self.seen.nearness_1_m(row + y - 1)[column - 1..];
            for (occluder_1_m, across) in occluders_1_m.iter().zip(across) {
                lit += if occluder_1_m * nearer_m <= 1.0 { across * down } else { 0.0 };
            }
        }
        lit / 9.0
    }
}
