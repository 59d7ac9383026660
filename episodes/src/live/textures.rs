//! Images on the surfaces of a scene. A page asks for each by its hash, once for all episodes.

use std::collections::HashMap;
use std::sync::Arc;

use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};
use serde_json::{Value, json};
use tandem_sim::mjcf::Texture;
use tandem_sim::render::PictureError;
use xxhash_rust::xxh3::xxh3_128_with_seed;

const JPEG_QUALITY: u8 = 90;

/// Image on surfaces, with the hash by which pages ask for it.
#[derive(Debug)]
pub struct LiveTexture {
    hash: String,
    texture: Arc<Texture>,
}

/// Image file.
pub struct ImageFile {
    pub media_type: &'static str,
    pub bytes: Vec<u8>,
}

/// Distinct images of a scene.
#[derive(Default)]
pub(crate) struct SceneTextures {
    pub found: Vec<Arc<LiveTexture>>,
    /// Indices in `found`, by address. Equal images at several addresses share an index.
    numbers: HashMap<*const Texture, usize>,
}

impl LiveTexture {
    fn of(texture: &Arc<Texture>) -> LiveTexture {
        let whole = &texture.levels[0];
        let shape = (whole.width as u64) << 1 | u64::from(texture.has_alpha);
        let hash = xxh3_128_with_seed(whole.texels.as_flattened(), shape);
        LiveTexture { hash: format!("{hash:032x}"), texture: texture.clone() }
    }

    pub fn hash(&self) -> &str {
        &self.hash
    }

    /// Returns the image as a file: PNG, or JPEG if that is smaller and nothing is transparent. The six
    /// images of a cube are stacked vertically.
    ///
    /// # Errors
    ///
    /// Returns an error if the image cannot be encoded.
    pub fn file(&self) -> Result<ImageFile, PictureError> {
        let Texture { levels, has_alpha, .. } = &*self.texture;
        let (width, height) = (levels[0].width as u32, (levels[0].height * self.texture.images()) as u32);
        let texels = &levels[0].texels;
        let mut png = Vec::new();
        let encoder = PngEncoder::new_with_quality(&mut png, CompressionType::Default, FilterType::Adaptive);
        if *has_alpha {
            encoder.write_image(texels.as_flattened(), width, height, ExtendedColorType::Rgba8)?;
            return Ok(ImageFile { media_type: "image/png", bytes: png });
        }
        let rgb: Vec<u8> = texels.iter().flat_map(|[red, green, blue, _]| [*red, *green, *blue]).collect();
        encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8)?;
        let mut jpeg = Vec::new();
        let encoder = JpegEncoder::new_with_quality(&mut jpeg, JPEG_QUALITY);
        encoder.write_image(&rgb, width, height, ExtendedColorType::Rgb8)?;
        Ok(match jpeg.len() < png.len() {
            true => ImageFile { media_type: "image/jpeg", bytes: jpeg },
            false => ImageFile { media_type: "image/png", bytes: png },
        })
    }
}

impl SceneTextures {
    /// Returns the number of an image in the scene.
    pub fn number(&mut self, texture: &Arc<Texture>) -> usize {
        if let Some(number) = self.numbers.get(&Arc::as_ptr(texture)) {
            return *number;
        }
        let new = LiveTexture::of(texture);
        let known = self.found.iter().position(|found| found.hash == new.hash);
        let number = known.unwrap_or_else(|| {
            self.found.push(Arc::new(new));
            self.found.len() - 1
        });
        self.numbers.insert(Arc::as_ptr(texture), number);
        number
    }

    /// Returns the data about the images that pages need before the images are loaded.
    pub fn told(&self) -> Value {
        let told = |LiveTexture { hash, texture }: &LiveTexture| {
            json!({
                "hash": hash, "images": texture.images(), "mean_rgb": texture.mean_rgb,
                "has_alpha": texture.has_alpha,
            })
        };
        self.found.iter().map(|texture| told(texture)).collect()
    }
}

#[cfg(test)]
mod tests {
    use tandem_sim::mjcf::TextureLevel;

    use super::*;

    fn texture(width: usize, has_alpha: bool, texel: impl Fn(usize, usize) -> [u8; 4]) -> Arc<Texture> {
        let height = 64;
        let texels = (0..width * height).map(|at| texel(at % width, at / width)).collect();
        let size_px = [width as f32, height as f32];
        let level = TextureLevel { width, height, size_px, texels };
        Arc::new(Texture { levels: vec![level], mean_rgb: [0.5; 3], has_alpha })
    }

    fn squares(x: usize, y: usize) -> [u8; 4] {
        if (x / 8 + y / 8).is_multiple_of(2) { [200, 30, 90, 0] } else { [10, 240, 90, 0] }
    }

    fn waves(x: usize, y: usize) -> [u8; 4] {
        let value =
            |phase: f32| (127.0 + 100.0 * (x as f32 * 0.3 + phase).sin() * (y as f32 * 0.2).cos()) as u8;
        [value(0.0), value(1.0), value(2.0), (4 * y) as u8]
    }

    #[test]
    fn a_file_has_the_texels_of_its_image() {
        let check = |texture: &Arc<Texture>, media_type: &str, max_difference: u8| {
            let file = LiveTexture::of(texture).file().expect("a file");
            assert_eq!(file.media_type, media_type);
            let decoded = image::load_from_memory(&file.bytes).expect("an image").into_rgba8();
            let whole = &texture.levels[0];
            assert_eq!((decoded.width() as usize, decoded.height() as usize), (whole.width, whole.height));
            for (pixel, texel) in decoded.pixels().zip(&whole.texels) {
                let channels = if texture.has_alpha { 4 } else { 3 };
                for (one, other) in pixel.0.iter().zip(texel).take(channels) {
                    assert!(one.abs_diff(*other) <= max_difference, "{pixel:?} instead of {texel:?}");
                }
            }
        };
        check(&texture(32, false, squares), "image/png", 0);
        check(&texture(64, true, waves), "image/png", 0);
        check(&texture(256, false, waves), "image/jpeg", 12);
    }

    #[test]
    fn equal_images_are_one() {
        let mut textures = SceneTextures::default();
        let first = texture(32, false, squares);
        let others = [
            texture(32, false, squares),
            texture(64, false, squares),
            texture(32, true, squares),
            texture(32, false, waves),
        ];
        let numbers: Vec<usize> =
            [&first, &first].into_iter().chain(&others).map(|texture| textures.number(texture)).collect();
        assert_eq!(numbers, [0, 0, 0, 1, 2, 3]);
        assert_eq!(textures.told().as_array().map(Vec::len), Some(4));
    }
}
