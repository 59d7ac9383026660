//! Images of a world: RGB, metric depth and instance ids for any camera.
//!
//! [`Scenery`] is everything visible, built once per world; a [`Step`] gives the poses; a [`Renderer`],
//! chosen by [`RendererKind`], draws it. The embedded renderer has no system requirements.

mod baked;
mod blur;
mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod kind;
#[cfg(test)]
mod made;
mod path;
mod scene;
mod sensor;
mod shading;

pub use kind::RendererKind;
pub use scene::camera::{Camera, Cameras, Intrinsics, LensFlaw};
pub use scene::lens::{CameraModel, Distortion};
pub use scene::mesh::{TriangleMesh, Vertex};
pub use scene::shared::SharedMesh;
pub use scene::{Carrier, Lamp, Lamps, Part, PlacedScenery, Scenery, object_id, robot_rgba};
pub use sensor::{CameraMotion, CameraView, Shot};
pub use shading::Light;
pub use shading::pattern::Pattern;

use std::slice;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Step;
#[cfg(feature = "gpu")]
use gpu::colours as together;

/// Renderer of one scenery.
pub trait Renderer: Send {
    /// Returns the name of the renderer and its device.
    fn name(&self) -> &str;

    /// Renders the images of all `cameras` after `step`, in their order. Images may be drawn in parallel.
    fn render_all(&mut self, step: &Step, cameras: &[Camera]) -> Vec<Frame>;

    /// Renders the image of `camera` after `step`.
    fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        self.render_all(step, slice::from_ref(camera)).swap_remove(0)
    }

    /// Renders only the colours of the image of `camera` after `step`, in the format of [`Frame::rgb`], on
    /// the calling thread. It serves callers with their own threads.
    fn render_colours(&mut self, step: &Step, camera: &Camera) -> Vec<u8> {
        self.render(step, camera).rgb
    }

    /// Returns true if [`render_colours_together`] is faster than drawing the requests one by one.
    fn draws_together(&self) -> bool {
        false
    }

    /// Returns the renderer itself if it draws on a GPU.
    #[cfg(feature = "gpu")]
    fn on_gpu(&mut self) -> Option<&mut gpu::GpuRenderer> {
        None
    }
}

/// Parts of an image to draw.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    All,
    /// Colours, without depth and ids.
    Colours,
}

/// Views of one world, to be drawn together with views of other worlds.
pub struct RenderRequest<'a> {
    pub renderer: &'a mut dyn Renderer,
    pub step: &'a Step,
    pub cameras: Vec<Camera>,
}

/// Renders only the colours, in the format of [`Frame::rgb`], of the cameras of several worlds. The result is
/// ordered by world, then by camera. A GPU draws all images in one submission and reads them back at once;
/// other renderers draw one after another.
pub fn render_colours_together(mut requests: Vec<RenderRequest>) -> Vec<Vec<Vec<u8>>> {
    together(&mut requests).unwrap_or_else(|| {
        let each = |RenderRequest { renderer, step, cameras }: RenderRequest| {
            cameras.iter().map(|camera| renderer.render_colours(step, camera)).collect()
        };
        requests.into_iter().map(each).collect()
    })
}

#[cfg(not(feature = "gpu"))]
fn together(_: &mut [RenderRequest]) -> Option<Vec<Vec<Vec<u8>>>> {
    None
}

/// A rendered image, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub width: u32,
    pub height: u32,
    /// Three bytes a pixel, sRGB.
    pub rgb: Vec<u8>,
    /// Distance along the optical axis at the pixel's centre; infinite without a surface.
    pub depth_m: Vec<f32>,
    /// Id of the visible body: 0 for none, 1 for the room, then robots, then objects.
    pub ids: Vec<u32>,
}

/// Creates the embedded renderer. It draws on the calling thread, and on one further thread for each
/// additional image of a step.
pub fn cpu(scenery: Scenery) -> Box<dyn Renderer> {
    Box::new(cpu::CpuRenderer::new(scenery))
}

/// Creates the path tracer. It draws on all processor cores. Colours alone are drawn on the calling thread.
pub fn path(scenery: Scenery) -> Box<dyn Renderer> {
    Box::new(path::PathRenderer::new(baked::lit(scenery)))
}

/// Error while encoding an image.
pub type PictureError = image::ImageError;

/// Encodes 8-bit RGB, three bytes a pixel, as a PNG file; fast rather than small.
///
/// # Errors
///
/// Returns an error if `rgb` does not have the size of the image.
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

/// Encodes 8-bit grey, one byte a pixel, as a PNG file.
///
/// # Errors
///
/// Returns an error if `grey` does not have the size of the image.
pub fn encode_grey_png(width: u32, height: u32, grey: &[u8]) -> Result<Vec<u8>, PictureError> {
    let mut bytes = Vec::with_capacity(grey.len() / 4);
    let encoder = PngEncoder::new_with_quality(&mut bytes, CompressionType::Fast, FilterType::Adaptive);
    encoder.write_image(grey, width, height, ExtendedColorType::L8)?;
    Ok(bytes)
}

/// Depth unit of a 16-bit sample.
pub const DEPTH_UNIT_M: f64 = 0.001;

/// Encodes depth as a 16-bit PNG file in units of [`DEPTH_UNIT_M`]. A sample is 0 if there is no surface or
/// the depth exceeds the range.
///
/// # Errors
///
/// Returns an error if `depth_m` does not have the size of the image.
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
