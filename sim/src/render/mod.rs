//! Pictures of a world: RGB, metric depth and instance ids for any camera.
//!
//! [`Scenery`] is what there is to see, built once per world; a [`Step`] says where it is; a [`Renderer`] draws it:
//! [`RendererKind`] says which. The embedded one needs nothing of the system.

mod cpu;
#[cfg(feature = "gpu")]
mod gpu;
mod kind;
mod png;
mod scene;
mod shading;

pub use kind::RendererKind;
pub use png::{DEPTH_UNIT_M, PictureError, encode_depth_png, encode_png};
pub use scene::camera::{Camera, Cameras, Intrinsics};
pub use scene::mesh::{TriangleMesh, Vertex};
pub use scene::{Carrier, Part, PlacedScenery, Scenery, robot_rgba};
pub use shading::pattern::Pattern;

use crate::Step;

/// Draws the scenery that it was made for.
pub trait Renderer: Send {
    /// What it is, and on what device.
    fn name(&self) -> &str;

    /// What `camera` sees after `step`.
    fn render(&mut self, step: &Step, camera: &Camera) -> Frame;
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

/// The embedded renderer; it draws on the calling thread.
pub fn cpu(scenery: Scenery) -> Box<dyn Renderer> {
    Box::new(cpu::CpuRenderer::new(scenery))
}
