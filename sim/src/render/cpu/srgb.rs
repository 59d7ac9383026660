//! From linear light to sRGB, as pictures have it.

use crate::render::light::SRGB_STEPS;

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
    #[inline(always)]
    pub(super) fn encode(&self, linear_value: f32) -> u8 {
        // The sum's lowest bits are the rounded number.
        const ALL_BITS_WHOLE: f32 = (1 << 23) as f32;
        let index = (linear_value.clamp(0.0, 1.0) * LAST + ALL_BITS_WHOLE).to_bits();
        self.0[index as usize % SRGB_STEPS]
    }
}
