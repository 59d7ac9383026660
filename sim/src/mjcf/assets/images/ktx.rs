//! Images of KTX2 files: 8 bits a channel, plain or compressed by Zstandard.

use std::error::Error;

use image::{DynamicImage, GrayAlphaImage, GrayImage, RgbImage, RgbaImage};
use ktx2::{Format, MAGIC, Reader, SupercompressionScheme};

use crate::mjcf::assets::files::MAX_FILE_BYTES;

/// Advice in errors about files of other kinds.
const ADVICE: &str = "R8G8B8A8_SRGB, plain or with Zstandard, would be read";

/// Key of the directions of columns and rows, and its value for rows from bottom to top.
const ORIENTATION: &str = "KTXorientation";
const UPWARDS: &[u8] = b"ru";

/// Images of a file: one, or the six of a cube in the order +x, -x, +y, -y, +z, -z.
pub(super) struct KtxImages {
    pub faces: Vec<DynamicImage>,
    /// True if values are sRGB.
    pub is_srgb: bool,
}

/// Order of the channels of a texel.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Channels {
    Red,
    RedGreen,
    Rgb,
    Bgr,
    Rgba,
    Bgra,
}

impl KtxImages {
    /// Decodes the largest images of a file. Returns `None` if it is not a KTX2 file.
    ///
    /// # Errors
    ///
    /// Returns an error that lists the supported kinds, for a file of another kind or a damaged one.
    pub fn decode(bytes: &[u8]) -> Result<Option<KtxImages>, Box<dyn Error + Send + Sync>> {
        if !bytes.starts_with(&MAGIC) {
            return Ok(None);
        }
        let reader = Reader::new(bytes)?;
        let header = reader.header();
        let (channels, is_srgb) = channels(header.format).ok_or_else(|| match header.format {
            Some(format) => format!("its texels are {format:?}; {ADVICE}"),
            None => format!("its texels are of Basis Universal; {ADVICE}"),
        })?;
        if header.pixel_height == 0 || header.pixel_depth > 0 || header.layer_count > 1 {
            return Err("it has no single flat image or cube; write the image to a file of its own".into());
        }
        let (width, height) = (header.pixel_width, header.pixel_height);
        let face_bytes = (u64::from(width) * u64::from(height)).saturating_mul(channels.count());
        let all_bytes = face_bytes.saturating_mul(header.face_count.into());
        if all_bytes > MAX_FILE_BYTES {
            return Err(format!("it has {width} x {height} texels; make it smaller").into());
        }
        let level = reader.levels().next().ok_or("it has no image")?;
        let texels = match header.supercompression_scheme {
            None => level.data.to_vec(),
            Some(SupercompressionScheme::Zstandard) => {
                zstd::bulk::decompress(level.data, all_bytes as usize)?
            }
            Some(scheme) => return Err(format!("it is compressed by {scheme:?}; {ADVICE}").into()),
        };
        if texels.len() as u64 != all_bytes {
            return Err("it ends too early".into());
        }
        let is_upwards =
            reader.key_value_data().any(|(key, value)| key == ORIENTATION && value.starts_with(UPWARDS));
        let face = |texels: &[u8]| {
            let image = channels.image(width, height, texels.to_vec())?;
            Some(if is_upwards { image.flipv() } else { image })
        };
        let faces = texels.chunks_exact(face_bytes as usize).map(face).collect::<Option<_>>();
        Ok(Some(KtxImages { faces: faces.ok_or("it ends too early")?, is_srgb }))
    }
}

/// Returns the channels of a format, and true if its values are sRGB. Returns `None` for unsupported formats.
fn channels(format: Option<Format>) -> Option<(Channels, bool)> {
    match format? {
        Format::R8_UNORM => Some((Channels::Red, false)),
        Format::R8_SRGB => Some((Channels::Red, true)),
        Format::R8G8_UNORM => Some((Channels::RedGreen, false)),
        Format::R8G8_SRGB => Some((Channels::RedGreen, true)),
        Format::R8G8B8_UNORM => Some((Channels::Rgb, false)),
        Format::R8G8B8_SRGB => Some((Channels::Rgb, true)),
        Format::B8G8R8_UNORM => Some((Channels::Bgr, false)),
        Format::B8G8R8_SRGB => Some((Channels::Bgr, true)),
        Format::R8G8B8A8_UNORM => Some((Channels::Rgba, false)),
        Format::R8G8B8A8_SRGB => Some((Channels::Rgba, true)),
        Format::B8G8R8A8_UNORM => Some((Channels::Bgra, false)),
        Format::B8G8R8A8_SRGB => Some((Channels::Bgra, true)),
        _ => None,
    }
}

impl Channels {
    fn count(self) -> u64 {
        match self {
            Channels::Red => 1,
            Channels::RedGreen => 2,
            Channels::Rgb | Channels::Bgr => 3,
            Channels::Rgba | Channels::Bgra => 4,
        }
    }

    /// Returns an image of texels, row by row from the top left.
    fn image(self, width: u32, height: u32, mut texels: Vec<u8>) -> Option<DynamicImage> {
        if matches!(self, Channels::Bgr | Channels::Bgra) {
            texels.chunks_exact_mut(self.count() as usize).for_each(|texel| texel.swap(0, 2));
        }
        match self {
            Channels::Red => GrayImage::from_raw(width, height, texels).map(DynamicImage::from),
            Channels::RedGreen => GrayAlphaImage::from_raw(width, height, texels).map(DynamicImage::from),
            Channels::Rgb | Channels::Bgr => {
                RgbImage::from_raw(width, height, texels).map(DynamicImage::from)
            }
            Channels::Rgba | Channels::Bgra => {
                RgbaImage::from_raw(width, height, texels).map(DynamicImage::from)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Size of header, index of one level and an empty description of the format.
    const HEAD_BYTES: usize = 80 + 24 + 4;

    /// Returns a file of one level. `kind` has its number of the format, its faces and its compression.
    fn file(kind: [u32; 3], size_px: [u32; 2], level: &[u8], whole_bytes: u64) -> Vec<u8> {
        let [format, faces, compression] = kind;
        let [width, height] = size_px;
        let mut file = MAGIC.to_vec();
        let numbers = [format, 1, width, height, 0, 0, faces, 1, compression, 104, 4, 0, 0];
        file.extend(numbers.into_iter().flat_map(u32::to_le_bytes));
        file.extend(
            [0, 0, HEAD_BYTES as u64, level.len() as u64, whole_bytes].into_iter().flat_map(u64::to_le_bytes),
        );
        file.extend(4u32.to_le_bytes());
        file.extend(level);
        file
    }

    fn decoded(bytes: &[u8]) -> Result<KtxImages, String> {
        match KtxImages::decode(bytes) {
            Ok(images) => images.ok_or("it is no KTX2 file".into()),
            Err(error) => Err(error.to_string()),
        }
    }

    #[test]
    fn texels_are_those_of_the_file_plain_or_compressed() {
        let texels: Vec<u8> = (0..24).collect();
        let packed = zstd::bulk::compress(&texels, 3).expect("bytes");
        for (format, faces, size_px, is_srgb, first, of_last) in [
            (43, 1, [3, 2], true, [0, 1, 2, 3], 0),
            (44, 1, [2, 3], false, [2, 1, 0, 3], 2),
            (23, 1, [4, 2], false, [0, 1, 2, 255], 0),
            (15, 6, [2, 2], true, [0, 0, 0, 255], 20),
            (16, 3, [2, 2], false, [0, 0, 0, 1], 16),
        ] {
            for (compression, level) in [(0, &texels), (2, &packed)] {
                let found =
                    decoded(&file([format, faces, compression], size_px, level, 24)).expect("an image");
                assert_eq!((found.faces.len() as u32, found.is_srgb), (faces, is_srgb));
                let last = found.faces.last().expect("an image").to_rgba8();
                assert_eq!(found.faces[0].to_rgba8().get_pixel(0, 0).0, first);
                assert_eq!(last.dimensions(), size_px.into());
                assert_eq!(last.get_pixel(0, 0).0[0], of_last);
            }
        }
    }

    #[test]
    fn other_files_are_refused_with_what_would_be_read() {
        let texels = [7; 16];
        for (kind, size_px, level, expected) in [
            (
                [146, 1, 0],
                [4, 4],
                &texels[..],
                "its texels are BC7_SRGB_BLOCK; R8G8B8A8_SRGB, plain or with Zstandard",
            ),
            ([0, 1, 1], [4, 4], &texels[..], "its texels are of Basis Universal"),
            ([43, 1, 3], [2, 2], &texels[..], "it is compressed by ZLIB"),
            ([43, 1, 0], [2, 2], &texels[..15], "it ends too early"),
            ([43, 1, 2], [2, 2], &texels[..], ""),
            ([43, 1, 0], [1 << 20, 1 << 20], &texels[..], "make it smaller"),
        ] {
            let error = decoded(&file(kind, size_px, level, 16)).err().expect(expected);
            assert!(error.contains(expected), "{error}");
        }
        assert!(decoded(&MAGIC).is_err());
        assert!(KtxImages::decode(b"no image").expect("no KTX2 file").is_none());
    }
}
