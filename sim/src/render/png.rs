//! PNG files.

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

/// Why a picture could not be encoded.
pub type PictureError = image::ImageError;

/// Encodes 8-bit RGB, three bytes a pixel; fast rather than small.
pub fn encode_png(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(rgb.len() / 2);
    PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive).write_image(
        rgb,
        width,
        height,
        ExtendedColorType::Rgb8,
    )?;
    Ok(bytes)
}

/// What one step of a 16-bit sample of depth stands for.
pub const DEPTH_UNIT_M: f64 = 0.001;

/// Encodes depth as 16 bits of [`DEPTH_UNIT_M`]; 0 where nothing is or it is further than that can say.
pub fn encode_depth_png(width: u32, height: u32, depth_m: &[f32]) -> Result<Vec<u8>, PictureError> {
    let units = |depth_m: &f32| {
        let units = (f64::from(*depth_m) / DEPTH_UNIT_M).round();
        if units <= f64::from(u16::MAX) { units as u16 } else { 0 }
    };
    let samples: Vec<u8> = depth_m.iter().map(units).flat_map(u16::to_ne_bytes).collect();
    let mut bytes = Vec::with_capacity(samples.len() / 4);
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    encoder.write_image(&samples, width, height, ExtendedColorType::L16)?;
    Ok(bytes)
}
