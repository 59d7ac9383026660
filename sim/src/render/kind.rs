//! The choice of the renderer.

use serde::{Deserialize, Serialize};

use super::{Renderer, Scenery, cpu, path};
use crate::SimError;

/// Renderer of camera images. No state of a world depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RendererKind {
    /// A GPU if there is one, otherwise the embedded renderer.
    #[default]
    Auto,
    /// The embedded renderer.
    Cpu,
    /// A GPU, or a software renderer in its place.
    Gpu,
    /// Path tracing on the CPU.
    Path,
}

impl RendererKind {
    pub const ALL: [RendererKind; 4] =
        [RendererKind::Auto, RendererKind::Cpu, RendererKind::Gpu, RendererKind::Path];

    pub fn name(self) -> &'static str {
        match self {
            RendererKind::Auto => "auto",
            RendererKind::Cpu => "cpu",
            RendererKind::Gpu => "gpu",
            RendererKind::Path => "path",
        }
    }

    /// Returns a line for the log about the renderer in use.
    ///
    /// # Errors
    ///
    /// Returns an error if this build lacks the requested renderer.
    pub fn describe(self) -> Result<String, SimError> {
        match self {
            RendererKind::Cpu => Ok(EMBEDDED.into()),
            RendererKind::Auto => Ok(on_real_gpu().unwrap_or_else(|| EMBEDDED.into())),
            RendererKind::Gpu => on_gpu(),
            RendererKind::Path => Ok("pictures are drawn by path tracing on the CPU".into()),
        }
    }

    /// Creates a renderer for a scenery. Falls back to the embedded renderer if a GPU cannot be used.
    pub fn renderer(self, scenery: Scenery) -> Box<dyn Renderer> {
        match self {
            RendererKind::Auto if on_real_gpu().is_some() => gpu(scenery),
            RendererKind::Auto | RendererKind::Cpu => cpu(scenery),
            RendererKind::Gpu => gpu(scenery),
            RendererKind::Path => path(scenery),
        }
    }
}

const EMBEDDED: &str = "pictures are drawn by the embedded renderer";

#[cfg(feature = "gpu")]
fn on_gpu() -> Result<String, SimError> {
    Ok(match super::gpu::name() {
        Ok(name) => format!("pictures are drawn by {name}"),
        Err(error) => format!("{EMBEDDED}: {error}"),
    })
}

#[cfg(not(feature = "gpu"))]
fn on_gpu() -> Result<String, SimError> {
    Err(SimError::WithoutGpu)
}

/// Describes a hardware GPU. Returns `None` if there is none or only a software renderer.
#[cfg(feature = "gpu")]
fn on_real_gpu() -> Option<String> {
    super::gpu::is_real().then(on_gpu).and_then(Result::ok)
}

#[cfg(not(feature = "gpu"))]
fn on_real_gpu() -> Option<String> {
    None
}

#[cfg(feature = "gpu")]
fn gpu(scenery: Scenery) -> Box<dyn Renderer> {
    super::gpu::renderer(scenery.clone()).unwrap_or_else(|_| cpu(scenery))
}

#[cfg(not(feature = "gpu"))]
fn gpu(scenery: Scenery) -> Box<dyn Renderer> {
    cpu(scenery)
}
