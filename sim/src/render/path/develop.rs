//! Conversion of light to the colours of an image: surface colours, smooth edges, exposure and tone mapping.

use rapier3d::math::Vector;

use super::scene::{COATED, DIRECT, INDIRECT, LAYERS};
use super::view::{PathView, SeenSurface};
use crate::render::shading::lamps::linear_light;

/// Linear value from which bright tones are compressed, and the value that becomes white.
const KNEE_VALUE: f32 = 0.5;
const WHITE_VALUE: f32 = 3.0;
/// Minimum likeness of surfaces that share their light.
const ALIKE: f32 = 0.7;

/// Filtered light of an image, before exposure.
pub struct Negative<'a> {
    pub view: PathView<'a>,
    pub depth_m: Vec<f32>,
    /// The surface at each pixel's centre.
    pub guides: Vec<SeenSurface>,
    pub light_rgb: Vec<[Vector; LAYERS]>,
    pub width: usize,
    /// Factor from light to linear values of the image.
    pub exposure_factor: f32,
}

impl Negative<'_> {
    /// Returns the linear colour of a pixel: the mean over the surfaces that it shows.
    pub fn linear_rgb(&self, row: usize, column: usize) -> Vector {
        let around = self.view.look_around(row, column);
        let of_point = |(uv_px, seen): &([f32; 2], SeenSurface)| {
            let seen_rgb = match seen.id {
                0 => self.view.sky_rgb(*uv_px),
                _ => self.view.mirrored_rgb(self.seen_rgb(row, column, seen), seen),
            };
            self.view.veiled_rgb(*uv_px, seen_rgb, self.view.depth_m(seen))
        };
        let sum_rgb: Vector = around.iter().map(of_point).sum();
        sum_rgb / around.len() as f32
    }

    /// Returns the linear colour of a surface in a pixel, lit like the most similar surface at or around the
    /// pixel.
    fn seen_rgb(&self, row: usize, column: usize, seen: &SeenSurface) -> Vector {
        // Any surface ranks above the background, since even little light gives a better image than no light.
        let rank = |there: usize| match &self.guides[there] {
            SeenSurface { id: 0, .. } => -1.0,
            guide => seen.likeness(guide),
        };
        let own = row * self.width + column;
        let mut best = (rank(own), own);
        if best.0 < ALIKE {
            let height = self.guides.len() / self.width;
            for row in row.saturating_sub(1)..(row + 2).min(height) {
                for column in column.saturating_sub(1)..(column + 2).min(self.width) {
                    let there = row * self.width + column;
                    if rank(there) > best.0 {
                        best = (rank(there), there);
                    }
                }
            }
        }
        let layers_rgb = self.light_rgb[best.1];
        let emitted_rgb = match self.view.scene.prepared.scenery.lamps {
            Some(_) => seen.albedo * linear_light(Vector::splat(seen.gloss.emission_factor)),
            None => Vector::ZERO,
        };
        developed_rgb(seen, layers_rgb, self.exposure_factor) + emitted_rgb + seen.emitted_rgb
    }
}

/// Returns the linear colour of a surface under these layers of light.
pub fn developed_rgb(seen: &SeenSurface, layers_rgb: [Vector; LAYERS], exposure_factor: f32) -> Vector {
    let light_rgb = seen.albedo * (layers_rgb[DIRECT] + layers_rgb[INDIRECT] * seen.gloss.ambient_factor)
        + layers_rgb[COATED] * seen.coat_rgb();
    toned_rgb(light_rgb * exposure_factor)
}

/// Compresses bright tones; others stay. Source: Reinhard et al. 2002, equation 4, above the knee.
pub fn toned_rgb(linear_rgb: Vector) -> Vector {
    let tone = |value: f32| {
        if value <= KNEE_VALUE {
            return value;
        }
        let (room, white) = (1.0 - KNEE_VALUE, (WHITE_VALUE - KNEE_VALUE) / (1.0 - KNEE_VALUE));
        let above = (value - KNEE_VALUE) / room;
        (KNEE_VALUE + room * above * (1.0 + above / (white * white)) / (1.0 + above)).min(1.0)
    };
    Vector::new(tone(linear_rgb.x), tone(linear_rgb.y), tone(linear_rgb.z))
}
