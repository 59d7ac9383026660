//! Pictures in another size: one way of making them, for policies that look now as for data sets that are drawn later.

use image::{ImageBuffer, Rgb, RgbImage, imageops};

use super::Picture;

/// Smooth in both directions, as Pillow's bilinear filter.
const FILTER: imageops::FilterType = imageops::FilterType::Triangle;

/// A picture, for the functions of the library `image`.
pub type Pixels<'a> = ImageBuffer<Rgb<u8>, &'a [u8]>;

impl Picture {
    /// The pixels as they are.
    pub fn pixels(&self) -> Pixels<'_> {
        ImageBuffer::from_raw(self.width, self.height, &self.rgb[..]).expect("three bytes a pixel")
    }

    /// The whole picture, stretched to another width and height.
    pub fn scaled(&self, [width, height]: [u32; 2]) -> RgbImage {
        imageops::resize(&self.pixels(), width, height, FILTER)
    }
}
