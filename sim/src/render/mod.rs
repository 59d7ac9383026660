//! Pictures of a world: RGB, metric depth and instance ids for any camera.
//!
//! [`Scenery`] is what there is to see, built once per world; a [`Step`] says where it is; a [`Renderer`] draws it:
//! [`RendererKind`] says which. The embedded one needs nothing of the system.

mod blur;
mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod kind;
mod scene;
mod shading;

pub use kind::RendererKind;
pub use scene::camera::{Camera, Cameras, Intrinsics, LensFlaw};
pub use scene::mesh::{TriangleMesh, Vertex};
pub use scene::shared::SharedMesh;
pub use scene::{Carrier, Part, PlacedScenery, Scenery, robot_rgba};
pub use shading::Light;
pub use shading::pattern::Pattern;

use std::slice;

use image::codecs::png::{CompressionType, FilterType, PngEncoder};
use image::{ExtendedColorType, ImageEncoder};

use crate::Step;
#[cfg(feature = "gpu")]
use gpu::colours as together;

/// Draws the scenery that it was made for.
pub trait Renderer: Send {
    /// What it is, and on what device.
    fn name(&self) -> &str;

    /// What each of `cameras` sees after `step`, in their order. They may be drawn side by side.
    fn render_all(&mut self, step: &Step, cameras: &[Camera]) -> Vec<Frame>;

    /// What `camera` sees after `step`.
    fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        self.render_all(step, slice::from_ref(camera)).swap_remove(0)
    }

    /// The colours alone of what `camera` sees after `step`, as [`Frame::rgb`], drawn on this thread: for who has threads of its own.
    fn render_colours(&mut self, step: &Step, camera: &Camera) -> Vec<u8> {
        self.render(step, camera).rgb
    }

    /// Whether [`render_colours_together`] draws its pictures and those of others in less time than each of them does.
    fn draws_together(&self) -> bool {
        false
    }

    /// Itself, if it draws on a graphics processor.
    #[cfg(feature = "gpu")]
    fn on_gpu(&mut self) -> Option<&mut gpu::GpuRenderer> {
        None
    }
}

/// What of a picture is drawn.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Wanted {
    All,
    /// Without depth and ids.
    Colours,
}

/// Views of one world that are to be drawn with those of others.
pub struct RenderRequest<'a> {
    pub renderer: &'a mut dyn Renderer,
    pub step: &'a Step,
    pub cameras: Vec<Camera>,
}

/// The colours alone, as [`Frame::rgb`], of what the cameras of several worlds see: world by world, camera by camera. A graphics
/// processor gets all of it in one submission, and all pictures are read back at once; other renderers draw one after another.
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

/// A rendered picture, row by row from the top left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    pub width: u32,
    pub height: u32,
    /// Three bytes a pixel, sRGB.
    pub rgb: Vec<u8>,
    /// Distance along the optical axis at the pixel's centre; infinite where nothing is.
    pub depth_m: Vec<f32>,
    /// What is seen there: 0 nothing, 1 the room, then robots, then objects.
    pub ids: Vec<u32>,
}

/// The embedded renderer; it draws on the calling thread, and on one more for each further picture of a state.
pub fn cpu(scenery: Scenery) -> Box<dyn Renderer> {
    Box::new(cpu::CpuRenderer::new(scenery))
}

/// Why a picture could not be encoded.
pub type PictureError = image::ImageError;

/// Encodes 8-bit RGB, three bytes a pixel, as a PNG file; fast rather than small.
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

/// Encodes depth as a PNG file of 16 bits of [`DEPTH_UNIT_M`]; 0 where nothing is or it is further than that can say.
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
