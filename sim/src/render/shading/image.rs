//! Images on surfaces: the texels at a point, blended between texels and between mip levels.

use std::sync::{Arc, LazyLock};

use rapier3d::math::Vector;

use super::lanes::{Affine, Lanes, axes, lanes};
use super::linear;
use super::power::linear_value;
use crate::mjcf::{Gloss, SurfaceImage, Texture, TextureLevel, TextureMapping};

/// Image of a part, with the map to image coordinates.
#[derive(Clone)]
pub struct Image {
    pub texture: Arc<Texture>,
    /// Further layers with the same coordinates; see [`SurfaceImage`].
    pub gloss: Option<Arc<Texture>>,
    pub relief: Option<Arc<Texture>>,
    pub emitted: Option<Arc<Texture>>,
    /// Map from the part's mesh to coordinates that [`Image::place`] takes; `None` if the mesh gives
    /// texture coordinates.
    pub from_mesh: Option<Affine>,
    /// True if the coordinates are a direction from the centre of a cube.
    pub is_cube: bool,
    /// True if each face of the cube has its own image.
    has_faces: bool,
    /// Index of the smallest mip level.
    last_level: f32,
}

/// Position on an image: coordinates to the right and down. Their differences over a step in x and a step in
/// y span the footprint of the lookup.
#[derive(Clone, Copy)]
pub struct ImagePlace {
    pub uv: [f32; 2],
    pub x_step_uv: [f32; 2],
    pub y_step_uv: [f32; 2],
    /// Index of the cube face's image; 0 if there is only one image.
    pub face: usize,
}

/// Number of table steps per sRGB byte.
const LIGHT_STEPS: usize = 4;
const LIGHT_VALUES: usize = 256 * LIGHT_STEPS;
/// Linear light of sRGB values, in steps finer than a byte.
static LIGHT: LazyLock<[f32; LIGHT_VALUES]> =
    LazyLock::new(|| std::array::from_fn(|step| linear([step as f32 / (255 * LIGHT_STEPS) as f32; 3]).x));

/// Minimum component of a relief's normal along the surface normal.
pub const MIN_UPRIGHT_SHARE: f32 = 0.05;
/// Share of the interval between two mip levels in which both are blended.
pub const BLENDED_SHARE: f32 = 0.5;

impl Image {
    pub fn of(image: &SurfaceImage) -> Image {
        let from_mesh = match image.mapping {
            TextureMapping::Corners => None,
            TextureMapping::Along { scale_1_m: [x, y], centre_m: [centre_x, centre_y] } => Some(Affine([
                (Vector::X * x, -x * centre_x - 0.5),
                (Vector::Y * y, -y * centre_y - 0.5),
                (Vector::ZERO, 0.0),
            ])),
            TextureMapping::Cube { scale_1_m, centre_m } => {
                let from_centre = scale_1_m * centre_m;
                Some(Affine([
                    (Vector::X * scale_1_m.x, -from_centre.x),
                    (Vector::Y * scale_1_m.y, -from_centre.y),
                    (Vector::Z * scale_1_m.z, -from_centre.z),
                ]))
            }
        };
        let is_cube = matches!(image.mapping, TextureMapping::Cube { .. });
        let has_faces = is_cube && image.texture.images() > 1;
        let last_level = (image.texture.levels.len() - 1) as f32;
        Image {
            texture: image.texture.clone(),
            gloss: image.gloss.clone(),
            relief: image.relief.clone(),
            emitted: image.emitted.clone(),
            from_mesh,
            is_cube,
            has_faces,
            last_level,
        }
    }

    /// Returns the image of a sky.
    pub fn around(texture: &Arc<Texture>) -> Image {
        let last_level = (texture.levels.len() - 1) as f32;
        let has_faces = texture.images() > 1;
        Image {
            texture: texture.clone(),
            gloss: None,
            relief: None,
            emitted: None,
            from_mesh: None,
            is_cube: true,
            has_faces,
            last_level,
        }
    }

    /// Returns the linear colour of the sky along a ray (world frame), averaged over the footprint of the
    /// steps in x and y.
    #[inline(always)]
    pub fn sky_rgb(&self, ray: Vector, [x_step, y_step]: [Vector; 2]) -> Vector {
        // The cube's y axis points up. Source: MuJoCo's `render_gl3.c`.
        let on_cube = |ray: Vector| [ray.x, ray.z, -ray.y];
        self.rgb(&self.place(on_cube(ray), on_cube(x_step), on_cube(y_step))).into()
    }

    /// Returns the image position of three coordinates, given their differences over the steps in x and y.
    #[inline(always)]
    pub fn place(&self, values: [f32; 3], x_step_values: [f32; 3], y_step_values: [f32; 3]) -> ImagePlace {
        if self.is_cube {
            let place = on_cube(values, [x_step_values, y_step_values]);
            return ImagePlace { face: if self.has_faces { place.face } else { 0 }, ..place };
        }
        let flat = |[u, v, _]: [f32; 3]| [u, v];
        let (x_step_uv, y_step_uv) = (flat(x_step_values), flat(y_step_values));
        ImagePlace { uv: flat(values), x_step_uv, y_step_uv, face: 0 }
    }

    /// Returns the linear colour at a place, averaged over its footprint.
    #[inline(always)]
    pub fn rgb(&self, place: &ImagePlace) -> [f32; 3] {
        self.rgb_and_alpha(place).0
    }

    /// Returns the linear colour and the alpha at a place. Alpha is 1 for images without an alpha channel.
    #[inline(always)]
    pub fn rgb_and_alpha(&self, place: &ImagePlace) -> ([f32; 3], f32) {
        let texel = texel(&self.texture.levels, self.last_level, place, self.is_cube);
        (light_of(&texel), if self.texture.has_alpha { texel[3] / 255.0 } else { 1.0 })
    }

    /// Returns the linear colour of the light that the surface emits at a place. Returns `None` without a
    /// layer of emission.
    #[inline(always)]
    pub fn emitted_rgb(&self, place: &ImagePlace, gloss: &Gloss) -> Option<[f32; 3]> {
        let texture = self.emitted.as_ref()?;
        let last_level = (texture.levels.len() - 1) as f32;
        let place = ImagePlace { face: 0, ..*place };
        let factor = linear_value(gloss.emission_factor);
        Some(light_of(&texel(&texture.levels, last_level, &place, self.is_cube)).map(|value| value * factor))
    }

    /// Returns true if a layer changes ambient light or emits light.
    pub fn changes_light(&self) -> bool {
        self.gloss.is_some() || self.emitted.is_some()
    }

    /// Returns the channels of a texture at a place, each from 0 to 1.
    #[inline(always)]
    pub fn numbers(&self, texture: &Texture, place: &ImagePlace) -> [f32; 3] {
        let last_level = (texture.levels.len() - 1) as f32;
        let place = ImagePlace { face: 0, ..*place };
        let [first, second, third, _] = texel(&texture.levels, last_level, &place, self.is_cube);
        [first / 255.0, second / 255.0, third / 255.0]
    }
}

/// Returns the unit normal of a relief on a surface with the normal `normal`. Returns `normal` if the
/// relief's normal faces away from the eye. The gradients of the image coordinates may have any length.
/// Source: Blinn 1978, with a map of normals in place of heights.
#[inline(always)]
pub fn bent_normal(
    normal: Vector,
    eye_direction: Vector,
    [right, down]: [Vector; 2],
    [x, y, z]: [f32; 3],
) -> Vector {
    let along = |gradient: Vector| (gradient - normal * normal.dot(gradient)).normalize_or_zero();
    let (right, down) = (along(right), along(down));
    let [x, y, z] = [x, y, z].map(|number| 2.0 * number - 1.0);
    let bent = (right * x - down * y + normal * z.max(MIN_UPRIGHT_SHARE)).normalize_or(normal);
    if bent.dot(eye_direction) > 0.0 { bent } else { normal }
}

/// Converts sRGB values from 0 to 255 to linear light.
#[inline(always)]
fn light_of(texel: &Lanes<4>) -> [f32; 3] {
    let light = &*LIGHT;
    axes(
        #[inline(always)]
        |axis| light[index((texel[axis] * LIGHT_STEPS as f32).round_ties_even()) % LIGHT_VALUES],
    )
}

/// Returns the channels (0 to 255) at a place, averaged over its footprint.
#[inline(always)]
fn texel(levels: &[TextureLevel], last_level: f32, place: &ImagePlace, is_cube: bool) -> Lanes<4> {
    let [width, height] = levels[0].size_px;
    let texels_2 = |[u, v]: [f32; 2]| (u * width) * (u * width) + (v * height) * (v * height);
    let level = 0.5 * log2(texels_2(place.x_step_uv).max(texels_2(place.y_step_uv)));
    let level = level.max(0.0).min(last_level);
    let (whole, part) = (level.floor(), level - level.floor());
    let share = ((part - 0.5) / BLENDED_SHARE + 0.5).clamp(0.0, 1.0);
    let nearer = index(whole) + usize::from(share == 1.0);
    let mut texel = blend(&levels[nearer], place, is_cube);
    if share > 0.0 && share < 1.0 {
        let farther = blend(&levels[nearer + 1], place, is_cube);
        texel = lanes(|i| texel[i] + (farther[i] - texel[i]) * share);
    }
    texel
}

/// Returns the channels (0 to 255) at a place, interpolated between four texels of one level.
#[inline(always)]
fn blend(level: &TextureLevel, place: &ImagePlace, is_cube: bool) -> Lanes<4> {
    let [u, v] = place.uv;
    let [width, height] = level.size_px;
    let (mut x, mut y) = (u * width - 0.5, v * height - 0.5);
    if is_cube {
        // A face of a cube does not wrap around.
        (x, y) = (x.max(0.0).min(width - 1.0), y.max(0.0).min(height - 1.0));
    }
    let (left, top) = (x.floor(), y.floor());
    let (across, down) = (x - left, y - top);
    let (left, top) = (index(left), index(top));
    let (column, next_column) = (level.column(left), level.column(left + 1));
    let first = place.face * level.image_texels();
    let (row, next_row) = (first + level.row(top), first + level.row(top + 1));
    let texels = level.texels.as_slice();
    let upper = between(texels[row + column], texels[row + next_column], across);
    let lower = between(texels[next_row + column], texels[next_row + next_column], across);
    lanes(|i| upper[i] + (lower[i] - upper[i]) * down)
}

/// Converts a whole number modulo 2^22. Negative numbers are therefore correct modulo smaller powers of two.
#[inline(always)]
fn index(whole_value: f32) -> usize {
    const ALL_BITS_WHOLE: f32 = (3 << 22) as f32;
    (whole_value + ALL_BITS_WHOLE).to_bits() as usize % (1 << 22)
}

#[inline(always)]
fn between(first: [u8; 4], second: [u8; 4], share: f32) -> Lanes<4> {
    let first: Lanes<4> = lanes(|i| f32::from(first[i]));
    let second: Lanes<4> = lanes(|i| f32::from(second[i]));
    lanes(|i| first[i] + (second[i] - first[i]) * share)
}

/// Returns the position at which a direction meets a face of the cube.
/// Faces are in the order +x, -x, +y, -y, +z, -z.
/// Source: OpenGL 4.6, section 8.13.
#[inline]
fn on_cube([x, y, z]: [f32; 3], step_values: [[f32; 3]; 2]) -> ImagePlace {
    let (across, down, along, axis): ([f32; 3], [f32; 3], [f32; 3], _) =
        if x.abs() >= y.abs() && x.abs() >= z.abs() {
            ([0.0, 0.0, -1f32.copysign(x)], [0.0, -1.0, 0.0], [1f32.copysign(x), 0.0, 0.0], 0)
        } else if y.abs() >= z.abs() {
            ([1.0, 0.0, 0.0], [0.0, 0.0, 1f32.copysign(y)], [0.0, 1f32.copysign(y), 0.0], 1)
        } else {
            ([1f32.copysign(z), 0.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1f32.copysign(z)], 2)
        };
    let dot = |a: [f32; 3], b: [f32; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    let per_along = 1.0 / dot(along, [x, y, z]).max(f32::MIN_POSITIVE);
    let place = [across, down].map(|axis| dot(axis, [x, y, z]) * per_along);
    let [x_step_uv, y_step_uv] = step_values.map(|step| {
        [(across, place[0]), (down, place[1])]
            .map(|(axis, at)| 0.5 * (dot(axis, step) - at * dot(along, step)) * per_along)
    });
    let face = 2 * axis + usize::from([x, y, z][axis].is_sign_negative());
    ImagePlace { uv: place.map(|at| 0.5 * at + 0.5), x_step_uv, y_step_uv, face }
}

/// Returns the binary logarithm of a positive number, exact for powers of two and linear between them.
#[inline(always)]
fn log2(value: f32) -> f32 {
    value.to_bits() as f32 * (1.0 / (1 << 23) as f32) - 127.0
}
