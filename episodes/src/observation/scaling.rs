//! Scaling of images, common to live observations of policies and to data sets drawn later.

use fast_image_resize::{
    FilterType, ResizeAlg, ResizeOptions, Resizer,
    images::{TypedImage, TypedImageRef},
    pixels::U8x3,
};
use image::{ImageBuffer, Rgb, RgbImage};
use tandem_sim::render::{Camera, CameraView};

use super::Picture;

/// An image, for the functions of the library `image`.
pub type Pixels<'a> = ImageBuffer<Rgb<u8>, &'a [u8]>;

/// Returns the view that renders images of this size. A smaller image of the same aspect ratio is the
/// camera's own image, scaled. A policy that requests this size gets the same image.
pub fn drawing_view(own: CameraView, [width, height]: [u32; 2]) -> CameraView {
    let camera = own.camera;
    let same_shape =
        u64::from(width) * u64::from(camera.height) == u64::from(height) * u64::from(camera.width);
    match same_shape && width <= camera.width {
        true => own,
        false => CameraView { camera: Camera { width, height, ..camera }, ..own },
    }
}

/// Returns the colours of an image, scaled from the size in which it was rendered to another.
pub fn scaled_colours(rgb: Vec<u8>, drawn_px: [u32; 2], size_px: [u32; 2]) -> Vec<u8> {
    if drawn_px == size_px {
        return rgb;
    }
    Picture::new(drawn_px[0], drawn_px[1], rgb).scaled(size_px).into_raw()
}

impl Picture {
    /// Returns the unscaled pixels.
    pub fn pixels(&self) -> Pixels<'_> {
        ImageBuffer::from_raw(self.width, self.height, self.rgb()).expect("three bytes a pixel")
    }

    /// Returns the whole image stretched to another size. The result is smooth in both directions, and
    /// within 1 of 255 of Pillow's bilinear filter.
    pub fn scaled(&self, [width, height]: [u32; 2]) -> RgbImage {
        // The function that takes the pixel's type at run time has code for all types: 3 MB of the program.
        let own = TypedImageRef::<U8x3>::from_buffer(self.width, self.height, self.rgb())
            .expect("three bytes a pixel");
        let options = ResizeOptions::new().resize_alg(ResizeAlg::Convolution(FilterType::Bilinear));
        let mut scaled = RgbImage::new(width, height);
        let mut target =
            TypedImage::<U8x3>::from_buffer(width, height, &mut scaled).expect("three bytes a pixel");
        Resizer::new().resize_typed(&own, &mut target, &options).expect("neither crop nor memory is lacking");
        scaled
    }
}
