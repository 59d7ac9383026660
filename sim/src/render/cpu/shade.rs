//! Patches in one state of the world, and their light: one sun with shadow, a sky that lights from above, and
//! a faint headlight at the camera.

use rapier3d::math::{Matrix, Pose, Vector};

use super::contact::ContactMap;
use super::raster::Rays;
use super::shadow::ShadowMap;
use crate::mjcf::Gloss;
use crate::render::scene::prepared::{Patch, Prepared};
use crate::render::shading::baked::{LightCube, LightMap, LightTexel};
use crate::render::shading::image::Image;
use crate::render::shading::lanes::{Affine, LANES, Lanes, axes, lanes};
use crate::render::shading::{CONTACT, HIGHLIGHT, LAMP, SAMPLES, opacity};
use crate::render::{Carrier, Light, Pattern, PlacedScenery};

/// Number of points that are shaded together: enough to amortise a loop, few enough to fit the cache.
/// Another number changes the last bits of images, since a strip ends where a batch does.
pub(super) const BATCH: usize = 64;
/// Capacity for whole blocks of points, the last of which may extend beyond the batch.
const ROOM: usize = BATCH + LANES;

/// A patch in the world.
#[derive(Clone, Copy, Default)]
pub(super) struct Facet {
    /// The normal at a point p, of any length, is `normal + slope_1_m * p`.
    pub normal: Vector,
    pub slope_1_m: Option<Matrix>,
    pub linear_rgb: [Vector; 2],
    pub gloss: Gloss,
    pub pattern: Pattern,
    /// Map to the frame of the pattern, or to the coordinates of the image.
    pub pattern_from_world: Affine,
    /// True if the patch belongs to the room, where contact shadows fall on it.
    pub carries: bool,
}

/// Source of a strip's light.
#[derive(Clone, Copy)]
pub(super) enum StripLight<'a> {
    /// Sun and sky, or lamps of a file.
    Plain,
    Map(&'a LightMap, &'a [LightTexel]),
    Cube(&'a LightCube),
}

/// Adjacent pixels that show one patch.
pub(super) struct Strip<'a> {
    pub facet: &'a Facet,
    /// Image of the facet's part.
    pub image: Option<&'a Image>,
    /// Column and row of the first sample.
    pub sample: [usize; 2],
    /// Nearness of the samples, from the first one to the right.
    pub nearness_1_m: &'a [f32],
    pub first_pixel: usize,
    pub count: usize,
    /// Share of the pixels that the patch covers.
    pub share: f32,
    /// Alpha of a blended part; `None` for a solid one.
    pub alpha: Option<f32>,
    /// Baked light of the patch.
    pub light: StripLight<'a>,
    /// True if lamps light the scenery. They need more properties of a surface than a sun does.
    pub has_lamps: bool,
    /// True if layers of some surfaces change ambient light or emit light.
    pub has_layers: bool,
}

/// Points that are shaded together. They are stored coordinate by coordinate and processed in branchless
/// loops, so that several points are processed at once.
pub(super) struct Surfaces {
    count: usize,
    /// Points and directions, world frame.
    pub point_m: Vectors,
    /// Rays from the camera to the points; rays and normals have any length.
    pub ray: Vectors,
    pub normal: Vectors,
    pub albedo: Vectors,
    /// Emission, specular strength and shininess, and metallic shares, for lamps.
    pub gloss: Vectors,
    metallic_share: [f32; ROOM],
    /// Shares of ambient light, and emitted light, by layers; valid only with `has_layers`.
    pub ambient_share: [f32; ROOM],
    pub emitted: Vectors,
    pub has_layers: bool,
    /// Colours of images alone, for lamps; 1 without an image.
    pub texture: Vectors,
    /// Baked light, and the share of it that moving bodies can shadow.
    pub baked: Vectors,
    lamp_share: [f32; ROOM],
    /// Share of light that contact shadows leave.
    open_share: [f32; ROOM],
    /// The pixel of each point, and its weight there.
    pub pixels: [u32; ROOM],
    pub pixel_share: [f32; ROOM],
    /// Place in the shadow map, and the cell there.
    texel: Vectors,
    cell: [u32; ROOM],
    sun_factor: [f32; ROOM],
    eye_factor: [f32; ROOM],
    highlight_factor: [f32; ROOM],
    sunlit_share: [f32; ROOM],
}

/// One vector per point.
pub(super) struct Vectors([[f32; ROOM]; 3]);

impl Vectors {
    const ZERO: Vectors = Vectors([[0.0; ROOM]; 3]);

    #[inline(always)]
    pub(super) fn block(&self, at: usize) -> [Lanes; 3] {
        axes(
            #[inline(always)]
            |axis| *block(&self.0[axis], at),
        )
    }

    /// Returns the vectors of `N` points, which may be fewer than a block.
    #[inline(always)]
    pub(super) fn read<const N: usize>(&self, at: usize) -> [Lanes<N>; 3] {
        axes(
            #[inline(always)]
            |axis| lanes(|i| self.0[axis][at + i]),
        )
    }

    #[inline(always)]
    pub(super) fn set<const N: usize>(&mut self, at: usize, values: [Lanes<N>; 3]) {
        for (numbers, values) in self.0.iter_mut().zip(values) {
            *block_mut(numbers, at) = values;
        }
    }
}

#[inline(always)]
pub(super) fn block(values: &[f32; ROOM], at: usize) -> &Lanes {
    values[at..].first_chunk().expect("there is room for a block after each point")
}

#[inline(always)]
pub(super) fn block_mut<T, const N: usize>(values: &mut [T; ROOM], at: usize) -> &mut [T; N] {
    values[at..].first_chunk_mut().expect("there is room for a block after each point")
}

/// Returns emission, specular strength, shininess and metallic share of several points.
#[inline(always)]
pub(super) fn gloss_lanes<const N: usize>(gloss: Gloss) -> [Lanes<N>; 4] {
    let Gloss { emission_factor, specular_factor, shininess_factor, metallic_factor, .. } = gloss;
    [emission_factor, specular_factor, shininess_factor, metallic_factor].map(|value| [value; N])
}

#[inline(always)]
pub(super) fn dot(a: &[Lanes; 3], b: &[Lanes; 3], i: usize) -> f32 {
    a[0][i] * b[0][i] + a[1][i] * b[1][i] + a[2][i] * b[2][i]
}

/// Updates the facets, by patch index, of the parts whose pose differs from the state `before`.
pub(super) fn place(
    facets: &mut Vec<Facet>,
    prepared: &Prepared,
    placed: &PlacedScenery,
    before: &PlacedScenery,
) {
    facets.resize(prepared.patches.len(), Facet::default());
    let mut rest = facets.as_mut_slice();
    for patches in prepared.patches.chunk_by(|one, next| one.part == next.part) {
        let (facets, others) = std::mem::take(&mut rest).split_at_mut(patches.len());
        rest = others;
        let number = patches[0].part as usize;
        if before.world_from_mesh.get(number) != Some(&placed.world_from_mesh[number]) {
            place_part(facets, patches, prepared, number, placed.world_from_mesh[number]);
        }
    }
}

/// Updates the facets of a part with these patches.
fn place_part(facets: &mut [Facet], patches: &[Patch], prepared: &Prepared, number: usize, pose: Pose) {
    let part = &prepared.scenery.parts[number];
    let rotation = Matrix::from_quat(pose.rotation);
    let common = Facet {
        normal: Vector::ZERO,
        slope_1_m: None,
        linear_rgb: prepared.linear_rgb[number],
        gloss: part.gloss,
        pattern: part.pattern,
        pattern_from_world: prepared.pattern_from_world(number, pose),
        carries: part.carrier == Carrier::Room,
    };
    for (facet, patch) in facets.iter_mut().zip(patches) {
        let slope_1_m = patch.bend.slope_1_m.map(|slope_1_m| rotation * slope_1_m * rotation.transpose());
        let at_origin = slope_1_m.map_or(Vector::ZERO, |slope_1_m| slope_1_m * pose.translation);
        *facet = Facet { normal: rotation * patch.bend.normal - at_origin, slope_1_m, ..common };
        if let Some(uv) = patch.uv {
            facet.pattern_from_world = uv.affine().after(pose.inverse());
        }
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
            gloss: Vectors::ZERO,
            metallic_share: [0.0; ROOM],
            ambient_share: [1.0; ROOM],
            emitted: Vectors::ZERO,
            has_layers: false,
            texture: Vectors::ZERO,
            baked: Vectors::ZERO,
            lamp_share: [0.0; ROOM],
            open_share: [1.0; ROOM],
            pixels: [0; ROOM],
            pixel_share: [0.0; ROOM],
            texel: Vectors::ZERO,
            cell: [0; ROOM],
            sun_factor: [0.0; ROOM],
            eye_factor: [0.0; ROOM],
            highlight_factor: [0.0; ROOM],
            sunlit_share: [0.0; ROOM],
        }
    }

    /// Returns the number of points that can still be pushed.
    pub(super) fn room(&self) -> usize {
        BATCH - self.count
    }

    #[inline(always)]
    pub(super) fn push(&mut self, rays: &Rays, contact: &ContactMap, strip: &Strip<'_>) {
        self.has_layers = strip.has_layers;
        if strip.count == 1 {
            self.push_blocks::<1>(rays, contact, strip);
        } else {
            self.push_blocks::<LANES>(rays, contact, strip);
        }
        self.count += strip.count;
    }

    #[inline(always)]
    fn push_blocks<const N: usize>(&mut self, rays: &Rays, contact: &ContactMap, strip: &Strip<'_>) {
        let (x, y) = (strip.sample[0] as f32, strip.sample[1] as f32);
        let first_ray = rays.first_ray + rays.right_ray * x + rays.down_ray * y;
        for start in (0..strip.count).step_by(N) {
            let at = self.count + start;
            let samples = &strip.nearness_1_m[start * SAMPLES..];
            // Samples beyond the strip are meaningless, but the last strip of a row has no samples beyond it.
            let nearness_1_m: Lanes<N> = if samples.len() >= N * SAMPLES {
                lanes(|i| samples[i * SAMPLES])
            } else {
                lanes(|i| samples[i.min(strip.count - start - 1) * SAMPLES])
            };
            let depth_m: Lanes<N> = lanes(|i| 1.0 / nearness_1_m[i]);
            let across: Lanes<N> = lanes(|i| ((start + i) * SAMPLES) as f32);
            let ray: [Lanes<N>; 3] = axes(
                #[inline(always)]
                |axis| lanes(|i| first_ray[axis] + rays.right_ray[axis] * across[i]),
            );
            let point_m: [Lanes<N>; 3] = axes(
                #[inline(always)]
                |axis| lanes(|i| rays.eye_m[axis] + ray[axis][i] * depth_m[i]),
            );
            self.ray.set(at, ray);
            self.point_m.set(at, point_m);
            let alpha = self.set_surface(at, rays, strip, [&ray, &point_m], &depth_m);
            self.set_baked(at, strip.count - start, &strip.light, &point_m);
            *block_mut(&mut self.pixel_share, at) = match strip.alpha {
                None => [strip.share; N],
                Some(of_part) => lanes(|i| strip.share * opacity(of_part * alpha[i])),
            };
            *block_mut(&mut self.open_share, at) = [1.0; N];
            *block_mut(&mut self.pixels, at) = lanes::<u32, N>(|i| (strip.first_pixel + start + i) as u32);
            if strip.facet.carries {
                let darkness = contact.darkness(&point_m);
                *block_mut(&mut self.open_share, at) = lanes::<f32, N>(|i| 1.0 - CONTACT * darkness[i]);
            }
        }
    }

    /// Sets the surface of points whose rays, positions and depths are set. Returns its alpha.
    #[inline(always)]
    fn set_surface<const N: usize>(
        &mut self,
        at: usize,
        rays: &Rays,
        strip: &Strip<'_>,
        [ray, point_m]: [&[Lanes<N>; 3]; 2],
        depth_m: &Lanes<N>,
    ) -> Lanes<N> {
        let normal = strip.facet.normals(point_m);
        let Some(image) = strip.image else {
            self.normal.set(at, normal);
            self.albedo.set(at, strip.facet.albedo(point_m));
            if strip.has_lamps {
                self.set_gloss(at, gloss_lanes::<N>(strip.facet.gloss));
                self.texture.set(at, [[1.0; N]; 3]);
            }
            if strip.has_layers {
                self.set_layers(at, [1.0; N], [[0.0; N]; 3]);
            }
            return [1.0; N];
        };
        let shown = strip.facet.shown(image, rays, [ray, point_m, &normal], depth_m);
        self.normal.set(at, shown.normal);
        self.albedo.set(at, shown.albedo);
        if strip.has_lamps {
            self.set_gloss(at, shown.gloss);
            self.texture.set(at, shown.texture);
        }
        if strip.has_layers {
            self.set_layers(at, shown.ambient, shown.emitted);
        }
        shown.alpha
    }

    #[inline(always)]
    fn set_gloss<const N: usize>(&mut self, at: usize, gloss: [Lanes<N>; 4]) {
        let [emission, specular, shininess, metallic] = gloss;
        self.gloss.set(at, [emission, specular, shininess]);
        *block_mut(&mut self.metallic_share, at) = metallic;
    }

    #[inline(always)]
    pub(super) fn set_lamp_share<const N: usize>(&mut self, at: usize, share: Lanes<N>) {
        *block_mut(&mut self.lamp_share, at) = share;
    }

    /// Returns cosines to the sun, shares of its light, highlights, and shares of the baked light that moving
    /// bodies block.
    #[inline(always)]
    pub(super) fn towards_sun(&self, at: usize) -> [Lanes; 4] {
        [&self.sun_factor, &self.sunlit_share, &self.highlight_factor, &self.lamp_share]
            .map(|values| *block(values, at))
    }

    /// Adds the shares of all pushed points to those of their pixels.
    pub(super) fn add_shares(&self, pixel_share: &mut [f32]) {
        for (pixel, share) in self.pixels.iter().zip(&self.pixel_share).take(self.count) {
            pixel_share[*pixel as usize] += share;
        }
    }

    /// Clears the points and returns their number.
    pub(super) fn take_count(&mut self) -> usize {
        std::mem::take(&mut self.count)
    }

    /// Returns the points' weights in their pixels, reduced by contact shadows.
    #[inline(always)]
    pub(super) fn shares(&self, at: usize) -> Lanes {
        let (open, share) = (block(&self.open_share, at), block(&self.pixel_share, at));
        lanes(|i| open[i] * share[i])
    }

    /// Returns the metallic shares of points.
    #[inline(always)]
    pub(super) fn metallic(&self, at: usize) -> Lanes {
        *block(&self.metallic_share, at)
    }

    /// Adds the linear colours of all points to those of their pixels, and clears the points. `tint_rgb`
    /// multiplies baked light; if it is `None`, sun and sky light the points.
    #[inline(always)]
    pub(super) fn shade(
        &mut self,
        light: &Light,
        tint_rgb: Option<[f32; 3]>,
        shadow: &ShadowMap,
        sum_rgb: &mut [Vec<f32>; 3],
    ) {
        let count = std::mem::take(&mut self.count);
        for at in (0..count).step_by(LANES) {
            self.face(at, light, shadow);
        }
        for i in 0..count {
            let texel = axes(
                #[inline(always)]
                |axis| self.texel.0[axis][i],
            );
            self.sunlit_share[i] = match tint_rgb {
                _ if self.sun_factor[i] <= 0.0 => 0.0,
                None => shadow.sunlit(texel, self.cell[i]),
                Some(_) => shadow.lamplit(texel, self.cell[i]),
            };
        }
        for at in (0..count).step_by(LANES) {
            let mut colours = match tint_rgb {
                None => self.lit(at, light),
                Some(tint_rgb) => self.lit_by_baked(at, tint_rgb),
            };
            if self.has_layers {
                let ambient = match tint_rgb {
                    None => self.sky_light(at, light),
                    Some(tint_rgb) => self.reflected(at, tint_rgb),
                };
                self.add_layers(at, ambient, &mut colours);
            }
            let first = self.pixels[at];
            let beside =
                (first..).zip(&self.pixels[at..at + LANES]).fold(true, |all, (i, pixel)| all & (i == *pixel));
            for (sum, colours) in sum_rgb.iter_mut().zip(&colours) {
                if beside && at + LANES <= count {
                    let first = first as usize;
                    for (sum, colour) in sum[first..first + LANES].iter_mut().zip(colours) {
                        *sum += colour;
                    }
                } else {
                    for (pixel, colour) in self.pixels[at..].iter().zip(colours).take(count - at) {
                        sum[*pixel as usize] += colour;
                    }
                }
            }
        }
    }

    /// Computes the orientation of points relative to the light sources.
    #[inline(always)]
    fn face(&mut self, at: usize, light: &Light, shadow: &ShadowMap) {
        let (ray, normal) = (self.ray.block(at), self.normal.block(at));
        let per_ray: Lanes = lanes(|i| -1.0 / dot(&ray, &ray, i).sqrt());
        let per_normal: Lanes = lanes(|i| 1.0 / dot(&normal, &normal, i).sqrt());
        let towards_eye: Lanes = lanes(|i| dot(&normal, &ray, i) * per_ray[i] * per_normal[i]);
        let outwards: Lanes = lanes(|i| per_normal[i].copysign(towards_eye[i]));
        let normal: [Lanes; 3] = axes(
            #[inline(always)]
            |axis| lanes(|i| normal[axis][i] * outwards[i]),
        );
        let sun = light.sun_direction.to_array();
        let sun_factor: Lanes =
            lanes(|i| normal[0][i] * sun[0] + normal[1][i] * sun[1] + normal[2][i] * sun[2]);
        *block_mut::<f32, LANES>(&mut self.eye_factor, at) = lanes(|i| towards_eye[i].abs());
        *block_mut::<f32, LANES>(&mut self.sun_factor, at) = sun_factor;
        self.normal.set(at, normal);
        // Without sunlight, neither highlight nor shadow matters.
        if sun_factor.iter().fold(true, |away, factor| away & (*factor <= 0.0)) {
            return;
        }
        let half_way: [Lanes; 3] = axes(
            #[inline(always)]
            |axis| lanes(|i| ray[axis][i] * per_ray[i] + sun[axis]),
        );
        let along: Lanes = lanes(|i| dot(&normal, &half_way, i));
        let cosine_2: Lanes = lanes(|i| along[i] * along[i] / dot(&half_way, &half_way, i));
        let cosine_8: Lanes = lanes(|i| cosine_2[i] * cosine_2[i] * cosine_2[i] * cosine_2[i]);
        let cosine_40: Lanes = lanes(|i| cosine_8[i] * cosine_8[i] * cosine_8[i] * cosine_8[i] * cosine_8[i]);
        *block_mut::<f32, LANES>(&mut self.highlight_factor, at) =
            lanes(|i| if along[i] > 0.0 { HIGHLIGHT * cosine_40[i] } else { 0.0 });
        let texel = shadow.texels(&self.point_m.block(at), &normal);
        self.texel.set(at, texel);
        *block_mut::<u32, LANES>(&mut self.cell, at) = ShadowMap::cells(&texel);
    }

    /// Returns the colours of points in the light of sun, sky and headlight, weighted by the points' shares.
    #[inline(always)]
    fn lit(&self, at: usize, light: &Light) -> [Lanes; 3] {
        let (albedo, normal) = (self.albedo.block(at), self.normal.block(at));
        let (eye_factor, highlight) = (block(&self.eye_factor, at), block(&self.highlight_factor, at));
        let (sun_factor, sunlit) = (block(&self.sun_factor, at), block(&self.sunlit_share, at));
        let (open, share) = (block(&self.open_share, at), block(&self.pixel_share, at));
        axes(
            #[inline(always)]
            |axis| {
                let (below, above, sun) = (light.below_rgb[axis], light.above_rgb[axis], light.sun_rgb[axis]);
                lanes(|i| {
                    let ambient = below + (above - below) * (normal[2][i] * 0.5 + 0.5);
                    let unlit = albedo[axis][i] * (ambient + LAMP * eye_factor[i]);
                    let sunlight = (albedo[axis][i] * sun + highlight[i]) * (sun_factor[i] * sunlit[i]);
                    (unlit + sunlight) * (open[i] * share[i])
                })
            },
        )
    }
}
