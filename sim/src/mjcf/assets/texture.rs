//! Images of textures: reduced to powers of two, with mip levels down to one texel. A cube may have six
//! images, one per face.

use image::imageops::{FilterType, resize};
use image::{ImageBuffer, Pixel, Rgb, RgbImage, RgbaImage};

/// Maximum width and height of a stored image. Robots' cameras resolve no finer detail of a surface.
const MAX_SIDE: u32 = 1024;

/// Image of a texture, or the six images of a cube, with mip levels down to one texel.
#[derive(PartialEq)]
pub struct Texture {
    /// Never empty; the largest level first. Sides are powers of two.
    pub levels: Vec<TextureLevel>,
    /// Mean of the file's sRGB values, each 0 to 1.
    pub mean_rgb: [f32; 3],
    /// True if the fourth bytes of texels are alpha.
    pub has_alpha: bool,
}

/// No number is NaN, so equality is complete, and shared images are compared by their address.
impl Eq for Texture {}

/// Image at one size.
#[derive(PartialEq)]
pub struct TextureLevel {
    pub width: usize,
    pub height: usize,
    /// The same width and height as floating-point numbers.
    pub size_px: [f32; 2],
    /// sRGB and alpha, row by row from the top left. Without alpha, the fourth byte is 0. A cube has its six
    /// images in the order +x, -x, +y, -y, +z, -z.
    pub texels: Vec<[u8; 4]>,
}

/// Meaning of the bytes of texels.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(in crate::mjcf) enum TexelMeaning {
    /// sRGB values.
    Light,
    /// Numbers of a surface, for example its roughness.
    Numbers,
}

impl std::fmt::Debug for Texture {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        let TextureLevel { width, height, .. } = &self.levels[0];
        write!(f, "Texture of {width} x {height} texels")
    }
}

impl Texture {
    /// Reduces an image of at least one pixel, or the six images of a cube, to its levels. All images get the
    /// size of the largest.
    pub(in crate::mjcf) fn of(images: &[RgbImage]) -> Texture {
        Texture::reduced(images, false)
    }

    /// Reduces images with alpha as [`Texture::of`] does.
    pub(in crate::mjcf) fn with_alpha(images: &[RgbaImage]) -> Texture {
        Texture::reduced(images, true)
    }

    fn reduced<P>(images: &[ImageBuffer<P, Vec<u8>>], has_alpha: bool) -> Texture
    where
        P: Pixel<Subpixel = u8> + 'static,
    {
        let side = |pixels: fn(&ImageBuffer<P, Vec<u8>>) -> u32| {
            images.iter().map(pixels).max().unwrap_or(1).next_power_of_two().min(MAX_SIDE)
        };
        let (width, height) = (side(ImageBuffer::width), side(ImageBuffer::height));
        let texels = images.iter().flat_map(|image| match image.dimensions() == (width, height) {
            true => texels(image),
            false => texels(&resize(image, width, height, FilterType::Triangle)),
        });
        let whole = TextureLevel::new(width as usize, height as usize, texels.collect());
        Texture { levels: levels(whole, TexelMeaning::Light), mean_rgb: mean_rgb(images), has_alpha }
    }

    /// Returns an image of a single texel.
    pub(crate) fn plain(rgb: [u8; 3]) -> Texture {
        Texture::of(&[RgbImage::from_pixel(1, 1, Rgb(rgb))])
    }

    /// Combines channels from images of one face, at the size of the largest image. A channel without an
    /// image has the maximum value.
    pub(in crate::mjcf) fn of_channels(
        channels: [Option<(&Texture, usize)>; 4],
        meaning: TexelMeaning,
        mean_rgb: [f32; 3],
    ) -> Texture {
        let levels_of = channels.iter().flatten().map(|(texture, _)| &texture.levels[0]);
        let side = |of: fn(&TextureLevel) -> usize| levels_of.clone().map(of).max().unwrap_or(1);
        let (width, height) = (side(|level| level.width), side(|level| level.height));
        let value = |channel: &Option<(&Texture, usize)>, index: usize| {
            let Some((texture, number)) = channel else { return u8::MAX };
            let level = &texture.levels[0];
            // Sides are powers of two.
            let (row, column) =
                (index / width / (height / level.height), index % width / (width / level.width));
            level.texels[row * level.width + column][*number]
        };
        let texels =
            (0..width * height).map(|index| channels.each_ref().map(|channel| value(channel, index)));
        let whole = TextureLevel::new(width, height, texels.collect());
        Texture { levels: levels(whole, meaning), mean_rgb, has_alpha: meaning == TexelMeaning::Light }
    }

    /// Returns the number of images: 1, or 6 for a cube with one per face.
    pub fn images(&self) -> usize {
        self.levels[0].texels.len() / self.levels[0].image_texels()
    }
}

/// Returns a level and all smaller ones, each of half the size, down to one texel.
fn levels(whole: TextureLevel, meaning: TexelMeaning) -> Vec<TextureLevel> {
    let mut levels = vec![whole];
    while let Some(half) = levels.last().and_then(|level| level.halved(meaning)) {
        levels.push(half);
    }
    levels
}

impl TextureLevel {
    fn new(width: usize, height: usize, texels: Vec<[u8; 4]>) -> TextureLevel {
        TextureLevel { width, height, size_px: [width as f32, height as f32], texels }
    }

    /// Returns the column of a texel of the repeated image.
    #[inline(always)]
    pub fn column(&self, x: usize) -> usize {
        x & (self.width - 1)
    }

    /// Returns the index of the first texel of a row of the repeated image.
    #[inline(always)]
    pub fn row(&self, y: usize) -> usize {
        (y & (self.height - 1)) * self.width
    }

    /// Returns the number of texels of one image.
    #[inline(always)]
    pub fn image_texels(&self) -> usize {
        self.width * self.height
    }

    /// Returns the level of half the size. Returns `None` if an image has a single texel. A texel is the mean
    /// of those that it replaces; for light, the mean uses a gamma of 2.
    fn halved(&self, meaning: TexelMeaning) -> Option<TextureLevel> {
        let images = self.texels.len() / self.image_texels();
        if self.image_texels() == 1 {
            return None;
        }
        let (width, height) = ((self.width / 2).max(1), (self.height / 2).max(1));
        let (across, down) = (self.width / width, self.height / height);
        let exponent = if meaning == TexelMeaning::Light { 2 } else { 1 };
        let texel = |index: usize| {
            let corner = index / width * down * self.width + index % width * across;
            let mut sum = [0; 4];
            for row in 0..down {
                for texel in &self.texels[corner + row * self.width..][..across] {
                    sum = std::array::from_fn(|axis| sum[axis] + u32::from(texel[axis]).pow(exponent));
                }
            }
            sum.map(|sum| {
                let mean = sum as f32 / (across * down) as f32;
                (if meaning == TexelMeaning::Light { mean.sqrt() } else { mean }).round() as u8
            })
        };
        Some(TextureLevel::new(width, height, (0..images * width * height).map(texel).collect()))
    }
}

fn texels<P: Pixel<Subpixel = u8>>(image: &ImageBuffer<P, Vec<u8>>) -> Vec<[u8; 4]> {
    let texel = |pixel: &P| {
        let channels = pixel.channels();
        [channels[0], channels[1], channels[2], channels.get(3).copied().unwrap_or(0)]
    };
    image.pixels().map(texel).collect()
}

fn mean_rgb<P: Pixel<Subpixel = u8>>(images: &[ImageBuffer<P, Vec<u8>>]) -> [f32; 3] {
    let (mut sum, mut count) = ([0.0f64; 3], 0);
    for image in images {
        let mut sum_of_image = [0.0f64; 3];
        for pixel in image.pixels() {
            for (sum, value) in sum_of_image.iter_mut().zip(pixel.channels()) {
                *sum += f64::from(*value) / 255.0;
            }
        }
        let pixels = image.pixels().len().max(1);
        // Every image has the same area on the cube.
        sum = std::array::from_fn(|i| sum[i] + sum_of_image[i] / pixels as f64);
        count += 1;
    }
    sum.map(|sum| (sum / f64::from(count.max(1))) as f32)
}

#[cfg(test)]
mod tests {
    use image::Rgba;

    use super::*;

    #[test]
    fn levels_halve_down_to_the_mean_light() {
        let striped =
            RgbImage::from_fn(4, 2, |x, _| if x % 2 == 0 { Rgb([255, 0, 40]) } else { Rgb([0, 0, 40]) });
        let texture = Texture::of(&[striped]);
        let sizes: Vec<_> = texture.levels.iter().map(|level| (level.width, level.height)).collect();
        assert_eq!(sizes, [(4, 2), (2, 1), (1, 1)]);
        assert_eq!(texture.levels[1].texels, [[180, 0, 40, 0]; 2], "half the light is 71 % of the value");
        assert_eq!(texture.mean_rgb, [0.5, 0.0, (40.0f64 / 255.0) as f32]);
    }

    #[test]
    fn alpha_is_reduced_with_its_colours() {
        let half = RgbaImage::from_fn(2, 2, |x, _| Rgba([10, 20, 30, if x == 0 { 255 } else { 0 }]));
        let texture = Texture::with_alpha(&[half]);
        assert!(texture.has_alpha);
        assert_eq!(texture.levels[1].texels, [[10, 20, 30, 180]]);
    }

    #[test]
    fn sides_become_powers_of_two_within_the_limit() {
        for (size, expected) in [((3, 5), (4, 8)), ((1, 1), (1, 1)), ((2000, 6), (1024, 8))] {
            let level = &Texture::of(&[RgbImage::new(size.0, size.1)]).levels[0];
            assert_eq!((level.width as u32, level.height as u32), expected);
        }
    }

    #[test]
    fn images_of_a_cube_are_halved_each_by_itself() {
        let faces: Vec<_> = (0..6).map(|face| RgbImage::from_pixel(2, 2, Rgb([40 * face, 0, 0]))).collect();
        let texture = Texture::of(&faces);
        assert_eq!((texture.images(), texture.levels.len()), (6, 2));
        let reds: Vec<u8> = texture.levels[1].texels.iter().map(|texel| texel[0]).collect();
        assert_eq!(reds, [0, 40, 80, 120, 160, 200]);
    }
}
