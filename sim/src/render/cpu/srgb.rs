//! Between sRGB, as files and pictures have it, and linear light.

use rapier3d::math::Vector;

pub(super) fn linear(rgb: [f32; 3]) -> Vector {
    let decode = |v: f32| if v <= 0.040_45 { v / 12.92 } else { ((v + 0.055) / 1.055).powf(2.4) };
    Vector::from(rgb.map(decode))
}

/// Table from linear light to sRGB bytes.
pub(super) struct SrgbTable(Vec<u8>);

const TABLE_LAST: f32 = 4095.0;

impl Default for SrgbTable {
    fn default() -> SrgbTable {
        let encode = |v: f32| if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
        SrgbTable(
            (0..=TABLE_LAST as usize).map(|i| (encode(i as f32 / TABLE_LAST) * 255.0 + 0.5) as u8).collect(),
        )
    }
}

impl SrgbTable {
    #[inline(always)]
    pub(super) fn encode(&self, colour: Vector) -> [u8; 3] {
        let index = colour.clamp(Vector::ZERO, Vector::ONE) * TABLE_LAST + 0.5;
        index.to_array().map(|i| self.0[usize::from(i as u16)])
    }
}
