//! Blending of layers of surfaces over the pixels of an image.

use super::shade::{Strip, StripLight};
use super::target::RenderTarget;
use super::view::{Row, View};
use crate::render::scene::prepared::NOTHING;
use crate::render::shading::SAMPLES;
use crate::render::shading::power::blended;

const PER_PIXEL: usize = SAMPLES * SAMPLES;

impl View<'_> {
    /// Blends the layers over a row of pixels.
    #[inline(always)]
    pub(super) fn blend_veils(&self, y: usize, width: usize, row: &mut Row) {
        for layer in self.veils.farthest_first() {
            for sum in row.veil_rgb.iter_mut().chain([&mut row.veil_alpha]) {
                sum.clear();
                sum.resize(width, 0.0);
            }
            self.veil(layer, y, width, row);
            for (sum, veil) in row.sum_rgb.iter_mut().zip(&row.veil_rgb) {
                for ((sum, veil), alpha) in sum.iter_mut().zip(veil).zip(&row.veil_alpha) {
                    if *alpha > 0.0 {
                        *sum = blended(*sum, veil / alpha, *alpha);
                    }
                }
            }
        }
    }

    /// Shades a row of pixels of one layer.
    #[inline(always)]
    fn veil(&self, layer: &RenderTarget, y: usize, width: usize, row: &mut Row) {
        let rows: [&[u32]; SAMPLES] = std::array::from_fn(|i| layer.patches(y * SAMPLES + i));
        for x in 0..width {
            let seen: [u32; PER_PIXEL] =
                std::array::from_fn(|i| rows[i / SAMPLES][x * SAMPLES + i % SAMPLES]);
            if row.surfaces.room() < PER_PIXEL {
                self.shade_veils(row);
            }
            for (i, patch) in seen.iter().enumerate() {
                if *patch == NOTHING || seen[..i].contains(patch) {
                    continue;
                }
                let covered = seen[i..].iter().filter(|other| *other == patch).count();
                let part = self.prepared.patches[*patch as usize].part as usize;
                let sample = [x * SAMPLES + i % SAMPLES, y * SAMPLES + i / SAMPLES];
                let strip = Strip {
                    facet: &self.facets[*patch as usize],
                    image: self.prepared.images[part].as_ref(),
                    sample,
                    nearness_1_m: &layer.nearness_1_m(sample[1])[sample[0]..],
                    first_pixel: x,
                    count: 1,
                    share: covered as f32 / PER_PIXEL as f32,
                    light: StripLight::of(self.prepared, self.cubes, *patch),
                    alpha: Some(self.prepared.scenery.parts[part].alpha),
                    has_lamps: self.lamps.is_some(),
                    has_layers: self.prepared.has_layers,
                };
                row.surfaces.push(&self.rays, self.contact, &strip);
            }
        }
        self.shade_veils(row);
    }

    #[inline(always)]
    fn shade_veils(&self, row: &mut Row) {
        row.surfaces.add_shares(&mut row.veil_alpha);
        self.shade(&mut row.surfaces, &mut row.veil_rgb);
    }
}
