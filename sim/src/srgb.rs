//! The transfer function of sRGB (IEC 61966-2-1), whose values image files have.

/// Converts a value of 0 to 1 from sRGB to linear light.
pub fn linear_light(srgb_value: f32) -> f32 {
    if srgb_value <= 0.040_45 { srgb_value / 12.92 } else { ((srgb_value + 0.055) / 1.055).powf(2.4) }
}
