//! Scaling of images, common to live observations of policies and to data sets drawn later.

use fast_image_resize::{FilterType, PixelType, ResizeAlg, ResizeOptions, Resizer, images::ImageRef};
use image::{ImageBuffer, Rgb, RgbImage};

use super::Picture;

/// An image, for the functions of the library `image`.
pub type Pixels<'a> = ImageBuffer<Rgb<u8>, &'a [u8]>;

impl Picture {
    /// Returns the unscaled pixels.
    pub fn pixels(&self) -> Pixels<'_> {
        ImageBuffer::from_raw(self.width, self.height, self.rgb()).expect("three bytes a pixel")
    }

    /// Returns the whole image stretched to another size. The result is smooth in both directions, and
    /// within 1 of 255 of Pillow's bilinear filter.
    pub fn scaled(&self, [width, height]: [u32; 2]) -> RgbImage {
        let own =
            ImageRef::new(self.width, self.height, self.rgb(), PixelType::U8x3).expect("three bytes a pixel");
        let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
        let mut scaled = RgbImage::new(width, height);
        Resizer::new().resize(&own, &mut scaled, &options).expect("both have three bytes a pixel");
        scaled
    }
}
