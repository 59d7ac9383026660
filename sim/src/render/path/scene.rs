//! The light that surfaces of one state send along a ray.

use std::f32::consts::PI;

use rapier3d::math::Vector;

use super::directions::{cosine_about, facet_about};
use super::lights::{Beam, Lights};
use super::sequence::IndependentNumbers;
use super::space::body::{MetSides, PointUv};
use super::space::{Space, Spot};
use crate::mjcf::Gloss;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::image::{Image, ImagePlace, bent_normal};
use crate::render::shading::lanes::Affine;
use crate::render::{Pattern, PlacedScenery};

/// Maximum number of surfaces that reflect light on a path, after the visible one.
const MAX_BOUNCES: u32 = 4;
/// Number of bounces after which a path may end at random, and its maximum probability of continuing.
const SURE_BOUNCES: u32 = 1;
const MAX_SURVIVAL: f32 = 0.9;
/// Upper limit on the light of a path. Brighter paths would appear as specks.
const MAX_PATH_VALUE: f32 = 6.0;
/// Reflectance of the clear coat over all surfaces at normal incidence, and the squared width of the
/// distribution of its facets.
const COAT: f32 = 0.04;
const COAT_WIDTH_2: f32 = 0.015;
/// Minimum roughness: on smoother surfaces, single paths would be visible.
const MIN_COAT_ROUGHNESS: f32 = 0.2;

/// Minimum cosine between the normal of a mirror and the z axis of its mesh.
const MIN_MIRROR_COSINE: f32 = 0.999;
/// Width over which images on surfaces that reflect light on a path are averaged.
const REFLECTED_WIDTH_M: f32 = 0.02;

/// A state of a scenery, ready to be traced.
pub struct Scene<'a> {
    pub space: Space<'a>,
    pub prepared: &'a Prepared,
    pub lights: Lights,
    /// Blended surfaces, through which light passes.
    pub veils: Option<Space<'a>>,
    /// Map from the world to the frame of each part's pattern, or to the coordinates of its image.
    pub patterns: Vec<Affine>,
    /// Direction of the z axis of each part's mesh.
    pub upward_direction: Vec<Vector>,
}

/// Specular reflection of a surface.
#[derive(Clone, Copy)]
pub struct Coat {
    /// Reflectance at normal incidence.
    base_share: f32,
    /// Square of the width of the distribution of facets.
    width_2_ratio: f32,
}

/// Number of layers of the light at a visible point. Layers are filtered separately.
pub const LAYERS: usize = 3;
/// Indices of the layers: direct light of lamps, other light (both without the surface's colour), and the
/// reflection in its coat.
pub const DIRECT: usize = 0;
pub const INDIRECT: usize = 1;
pub const COATED: usize = 2;

/// Returns the map from the world to the frame of each part's pattern, or to the coordinates of its image.
pub fn patterns(prepared: &Prepared, placed: &PlacedScenery) -> Vec<Affine> {
    let poses = placed.world_from_mesh.iter().enumerate();
    poses.map(|(part, pose)| prepared.pattern_from_world(part, *pose)).collect()
}

impl Coat {
    /// Returns the coat of a surface: the clear coat if the surface has no gloss of its own, otherwise a
    /// rougher coat, or metal.
    pub fn of(gloss: &Gloss) -> Coat {
        let width_2_ratio = gloss.roughness_factor.map_or(COAT_WIDTH_2, |roughness| {
            let squared = roughness.clamp(MIN_COAT_ROUGHNESS, 1.0) * roughness.clamp(MIN_COAT_ROUGHNESS, 1.0);
            squared * squared
        });
        Coat { base_share: COAT + (1.0 - COAT) * gloss.metallic_factor, width_2_ratio }
    }

    /// Returns the share of light that is reflected. Source: Schlick 1994.
    fn reflected(&self, cosine_value: f32) -> f32 {
        let rest = 1.0 - cosine_value.clamp(0.0, 1.0);
        self.base_share + (1.0 - self.base_share) * rest * rest * rest * rest * rest
    }
}

impl Scene<'_> {
    /// Returns the linear colour of a surface, without light, averaged over about `width_m`.
    pub fn albedo(&self, spot: &Spot, width_m: f32) -> Vector {
        self.albedo_and_alpha(spot, width_m).0
    }

    /// Returns the linear colour of a surface, without light, and the alpha of its image.
    pub fn albedo_and_alpha(&self, spot: &Spot, width_m: f32) -> (Vector, f32) {
        let (part, point_m) = (spot.part as usize, spot.point_m);
        let [first, second] = self.prepared.linear_rgb[part];
        if let Some(image) = &self.prepared.images[part] {
            let place = self.image_place(image, spot, width_m);
            let (rgb, alpha) = image.rgb_and_alpha(&place);
            return (first * Vector::from(rgb), alpha);
        }
        let rgb = match self.prepared.scenery.parts[part].pattern {
            Pattern::Plain => first,
            pattern => {
                let point_m = self.patterns[part].map(point_m).map(|coordinate_m| [coordinate_m]);
                first + (second - first) * pattern.shares(point_m)[0]
            }
        };
        (rgb, 1.0)
    }

    /// Returns the colour of the image on a surface of the colour `albedo`; 1 without an image.
    pub fn texture_rgb(&self, spot: &Spot, albedo: Vector) -> Vector {
        let part = spot.part as usize;
        match self.prepared.images[part] {
            Some(_) => albedo / self.prepared.linear_rgb[part][0].max(Vector::splat(f32::MIN_POSITIVE)),
            None => Vector::ONE,
        }
    }

    fn image_place(&self, image: &Image, spot: &Spot, width_m: f32) -> ImagePlace {
        if image.from_mesh.is_none() {
            let PointUv { uv, uv_1_m, .. } = spot.uv;
            let step_uv = uv_1_m * width_m;
            return ImagePlace { uv, x_step_uv: [step_uv, 0.0], y_step_uv: [0.0, step_uv], face: 0 };
        }
        let map = &self.patterns[spot.part as usize];
        let across = spot.face_normal.any_orthonormal_vector();
        let by = |direction: Vector| map.0.map(|(axis, _)| axis.dot(direction * width_m));
        image.place(map.map(spot.point_m), by(across), by(spot.face_normal.cross(across)))
    }

    /// Returns the gloss of a surface and the light that a layer emits, averaged over about `width_m`.
    pub fn gloss_and_emitted_rgb(&self, spot: &Spot, width_m: f32) -> (Gloss, Vector) {
        let mut gloss = self.prepared.scenery.parts[spot.part as usize].gloss;
        let image = self.prepared.images[spot.part as usize].as_ref();
        let Some(image) = image.filter(|image| image.changes_light()) else { return (gloss, Vector::ZERO) };
        let place = self.image_place(image, spot, width_m);
        if let Some(texture) = &image.gloss {
            gloss = gloss.at_texel(image.numbers(texture, &place));
        }
        match image.emitted_rgb(&place, &gloss) {
            Some(rgb) => (Gloss { emission_factor: 0.0, ..gloss }, rgb.into()),
            None => (gloss, Vector::ZERO),
        }
    }

    /// Returns the share of the mirror image in the colour of a surface.
    pub fn mirror_share(&self, spot: &Spot) -> f32 {
        let share = self.prepared.scenery.parts[spot.part as usize].gloss.reflectance_factor;
        let is_upper = || self.upward_direction[spot.part as usize].dot(spot.normal) > MIN_MIRROR_COSINE;
        if share > 0.0 && is_upper() { share } else { 0.0 }
    }

    /// Returns a surface with the normal of its relief, averaged over about `width_m`.
    pub fn with_relief(&self, spot: Spot, eye_direction: Vector, width_m: f32) -> Spot {
        let Some(image @ Image { relief: Some(texture), .. }) = &self.prepared.images[spot.part as usize]
        else {
            return spot;
        };
        let gradients = match image.from_mesh {
            None => spot.uv.gradients.map(Vector::from),
            Some(_) => {
                let [(right, _), (down, _), _] = self.patterns[spot.part as usize].0;
                [right, down]
            }
        };
        let numbers = image.numbers(texture, &self.image_place(image, &spot, width_m));
        Spot { normal: bent_normal(spot.normal, eye_direction, gradients, numbers), ..spot }
    }

    /// Adds the light of one point of a lamp to the layers of a visible point.
    pub fn light_directly(
        &self,
        spot: &Spot,
        coat: Coat,
        view_ray: Vector,
        pair_values: [f32; 2],
        layers_rgb: &mut [Vector; LAYERS],
    ) {
        let beam = self.lights.beam(spot.start_m, pair_values);
        let lit_rgb = self.lit_rgb(spot.start_m, spot.normal, &beam);
        if lit_rgb == Vector::ZERO {
            return;
        }
        let half_way = (beam.direction - view_ray).normalize();
        let (reflected, width_2_ratio) = (coat.reflected(half_way.dot(beam.direction)), coat.width_2_ratio);
        let along_2 = half_way.dot(spot.normal).max(0.0).powi(2);
        let spread = along_2 * (width_2_ratio - 1.0) + 1.0;
        let density = width_2_ratio / (PI * spread * spread);
        layers_rgb[DIRECT] += lit_rgb * (1.0 - reflected);
        layers_rgb[COATED] += lit_rgb * (PI * density * reflected * 0.25);
    }

    /// Adds the light of one path through the coat to the layers of a visible point. It may also add the
    /// light of one path that the coat reflects. `through` and `mirrored` are the random numbers for the
    /// directions of these paths.
    pub fn light_indirectly(
        &self,
        spot: &Spot,
        coat: Coat,
        view_ray: Vector,
        [through, mirrored]: [[f32; 2]; 2],
        numbers: &mut IndependentNumbers,
        layers_rgb: &mut [Vector; LAYERS],
    ) {
        let reflected = coat.reflected(-spot.normal.dot(view_ray));
        let direction = cosine_about(spot.normal, through);
        if direction.dot(spot.face_normal) > 0.0 {
            layers_rgb[INDIRECT] += self.arriving_rgb(spot.start_m, direction, numbers) * (1.0 - reflected);
        }
        // The less the coat reflects, the fewer paths follow it.
        let followed = (reflected * 5.0).min(1.0);
        if numbers.uniform() < followed {
            let facet = facet_about(spot.normal, coat.width_2_ratio, mirrored);
            let direction = view_ray - facet * (2.0 * view_ray.dot(facet));
            if direction.dot(spot.face_normal) > 0.0 {
                let arriving_rgb = self.arriving_rgb(spot.start_m, direction, numbers);
                layers_rgb[COATED] += arriving_rgb * (reflected / followed);
            }
        }
    }

    /// Returns the light of one path that reaches a point from a direction. Coats of surfaces on the path
    /// block light, but their reflections are neglected.
    pub fn arriving_rgb(
        &self,
        mut start_m: Vector,
        mut direction: Vector,
        numbers: &mut IndependentNumbers,
    ) -> Vector {
        let (mut sum_rgb, mut carried_rgb) = (Vector::ZERO, Vector::ONE);
        for bounce in 0..MAX_BOUNCES {
            let Some((_, hit)) = self.space.nearest(start_m, direction, 0.0, MetSides::Both) else {
                sum_rgb += carried_rgb * self.lights.sky_rgb(direction);
                break;
            };
            let spot = self.space.spot(start_m, direction, &hit);
            carried_rgb *= self.albedo(&spot, REFLECTED_WIDTH_M);
            let beam = self.lights.beam(spot.start_m, numbers.pair());
            sum_rgb += carried_rgb * self.lit_rgb(spot.start_m, spot.normal, &beam);
            if bounce >= SURE_BOUNCES {
                let survival = carried_rgb.max_element().min(MAX_SURVIVAL);
                if numbers.uniform() >= survival {
                    break;
                }
                carried_rgb /= survival;
            }
            direction = cosine_about(spot.normal, numbers.pair());
            if direction.dot(spot.face_normal) <= 0.0 {
                break;
            }
            start_m = spot.start_m;
        }
        sum_rgb.min(Vector::splat(MAX_PATH_VALUE))
    }

    /// Returns the irradiance by a beam at a point with a normal, divided by pi.
    pub fn lit_rgb(&self, start_m: Vector, normal: Vector, beam: &Beam) -> Vector {
        let facing = normal.dot(beam.direction);
        if facing <= 0.0
            || beam.rgb == Vector::ZERO
            || self.space.is_blocked(start_m, beam.direction, beam.reach_m)
        {
            return Vector::ZERO;
        }
        beam.rgb * facing
    }
}
