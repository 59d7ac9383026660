//! Pictures of a world: RGB, metric depth and instance ids for any camera, from one scene description.
//!
//! [`RenderScene`] is what every back end draws; [`CpuRenderer`] is the embedded one and needs nothing of the system.

mod camera;
mod cpu;
mod mesh;
mod png;
mod raster;
mod shade;
mod shadow;

pub use camera::Camera;
pub use cpu::CpuRenderer;
pub use mesh::{Mesh, Vertex};
pub use png::{PictureError, encode_png};

use rapier3d::math::{Pose, Vector};

/// Meshes that never change and instances that move.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct RenderScene {
    pub meshes: Vec<Mesh>,
    pub instances: Vec<Instance>,
    /// Shadows are drawn within this distance of this point (world): the smaller, the sharper.
    pub focus_m: Vector,
    pub focus_radius_m: f32,
}

/// One mesh somewhere.
#[derive(Clone, Debug, PartialEq)]
pub struct Instance {
    pub mesh: usize,
    pub world_from_mesh: Pose,
    /// sRGB, 0 to 1.
    pub rgb: [f32; 3],
    pub pattern: Pattern,
    /// What [`Frame::ids`] shows for it; parts of one thing share one. 0 is the background.
    pub id: u32,
    pub casts_shadow: bool,
}

/// How a surface varies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Pattern {
    #[default]
    Plain,
    /// Squares of half a metre in the world's ground plane.
    Checker,
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
    pub ids: Vec<u32>,
}
