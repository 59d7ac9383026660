//! Pictures and films as WebP.

use webp_animation::{ColorMode, Encoder, EncoderOptions, EncodingConfig, Error};

/// Of 100; the robots' edges stay clean.
const QUALITY: f32 = 80.0;

/// One RGB picture, three bytes a pixel, as a file.
pub fn picture(width: u32, height: u32, rgb: &[u8]) -> Result<Vec<u8>, Error> {
    let mut encoder = encoder((width, height))?;
    encoder.add_frame(rgb, 0)?;
    Ok(encoder.finalize(1)?.to_vec())
}

/// An encoder of RGB pictures.
pub fn encoder(size_px: (u32, u32)) -> Result<Encoder, Error> {
    let options = EncoderOptions {
        color_mode: ColorMode::Rgb,
        encoding_config: Some(EncodingConfig::new_lossy(QUALITY)),
        ..EncoderOptions::default()
    };
    Encoder::new_with_options(size_px, options)
}
