//! Conversion of linear light to sRGB.

use super::SRGB_STEPS;
use super::lanes::{LANES, Lanes, lanes};

/// Table from linear light to sRGB, as used in images.
pub struct SrgbTable([u8; SRGB_STEPS]);

const LAST: f32 = (SRGB_STEPS - 1) as f32;

impl Default for SrgbTable {
    fn default() -> SrgbTable {
        let encode = |v: f32| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        SrgbTable(std::array::from_fn(|i| (encode(i as f32 / LAST) * 255.0 + 0.5) as u8))
    }
}

impl SrgbTable {
    /// Writes the bytes of pixels whose linear colours are given channel by channel.
    #[inline(always)]
    pub fn encode(&self, linear_rgb: &[Vec<f32>; 3], bytes: &mut [u8]) {
        for (values, axis) in linear_rgb.iter().zip(0..) {
            let (blocks, rest) = values.as_chunks::<LANES>();
            let (byte_blocks, byte_rest) = bytes.as_chunks_mut::<{ 3 * LANES }>();
            for (bytes, values) in byte_blocks.iter_mut().zip(blocks) {
                let places: Lanes = lanes(|i| place(values[i]));
                for (i, place) in places.into_iter().enumerate() {
                    bytes[3 * i + axis] = self.at(place);
                }
            }
            for (i, value) in rest.iter().enumerate() {
                byte_rest[3 * i + axis] = self.at(place(*value));
            }
        }
    }

    #[inline(always)]
    fn at(&self, place_value: f32) -> u8 {
        self.0[place_value.to_bits() as usize % SRGB_STEPS]
    }
}

/// Returns a float whose lowest bits are the index in the table.
#[inline(always)]
fn place(linear_value: f32) -> f32 {
    const ALL_BITS_WHOLE: f32 = (1 << 23) as f32;
    let within = if linear_value > 0.0 { linear_value } else { 0.0 };
    (if within < 1.0 { within } else { 1.0 }) * LAST + ALL_BITS_WHOLE
}
