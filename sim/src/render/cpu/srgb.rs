//! From linear light to sRGB, as pictures have it.

use crate::render::shading::light::SRGB_STEPS;
use crate::render::shading::rows::{LANES, Lanes, lanes};

/// Table from linear light to sRGB bytes.
pub(super) struct SrgbTable([u8; SRGB_STEPS]);

const LAST: f32 = (SRGB_STEPS - 1) as f32;

impl Default for SrgbTable {
    fn default() -> SrgbTable {
        let encode = |v: f32| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        SrgbTable(std::array::from_fn(|i| (encode(i as f32 / LAST) * 255.0 + 0.5) as u8))
    }
}

impl SrgbTable {
    /// Bytes of linear numbers.
    #[inline(always)]
    pub(super) fn encode(&self, linear_values: &[f32], bytes: &mut [u8]) {
        let (value_blocks, values) = linear_values.as_chunks::<LANES>();
        let (byte_blocks, rest) = bytes.as_chunks_mut::<LANES>();
        for (bytes, values) in byte_blocks.iter_mut().zip(value_blocks) {
            let places: Lanes = lanes(|i| place(values[i]));
            for (byte, place) in bytes.iter_mut().zip(places) {
                *byte = self.at(place);
            }
        }
        for (byte, value) in rest.iter_mut().zip(values) {
            *byte = self.at(place(*value));
        }
    }

    #[inline(always)]
    fn at(&self, place_value: f32) -> u8 {
        self.0[place_value.to_bits() as usize % SRGB_STEPS]
    }
}

/// A number whose lowest bits are the place in the table.
#[inline(always)]
fn place(linear_value: f32) -> f32 {
    const ALL_BITS_WHOLE: f32 = (1 << 23) as f32;
    let within = if linear_value > 0.0 { linear_value } else { 0.0 };
    (if within < 1.0 { within } else { 1.0 }) * LAST + ALL_BITS_WHOLE
}
