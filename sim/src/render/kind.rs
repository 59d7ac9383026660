//! Which renderer draws.

use serde::{Deserialize, Serialize};

use super::{Renderer, Scenery, cpu};
use crate::SimError;

/// Who draws what cameras see. No state of a world depends on it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RendererKind {
    /// A graphics processor where there is one, or else the embedded renderer.
    #[default]
    Auto,
    /// The embedded one.
    Cpu,
    /// A graphics processor, or software in its place.
    Gpu,
}

impl RendererKind {
    pub const ALL: [RendererKind; 3] = [RendererKind::Auto, RendererKind::Cpu, RendererKind::Gpu];

    pub fn name(self) -> &'static str {
        match self {
            RendererKind::Auto => "auto",
            RendererKind::Cpu => "cpu",
            RendererKind::Gpu => "gpu",
        }
    }

    /// A line about who will draw, for the log. An error if this build lacks what was asked for.
    pub fn describe(self) -> Result<String, SimError> {
        match self {
            RendererKind::Cpu => Ok(EMBEDDED.into()),
            RendererKind::Auto => Ok(on_real_gpu().unwrap_or_else(|| EMBEDDED.into())),
            RendererKind::Gpu => on_gpu(),
        }
    }

    /// Draws a scenery. Where a graphics processor cannot, the embedded renderer does.
    pub fn renderer(self, scenery: Scenery) -> Box<dyn Renderer> {
        match self {
            RendererKind::Auto if on_real_gpu().is_some() => gpu(scenery),
            RendererKind::Auto | RendererKind::Cpu => cpu(scenery),
            RendererKind::Gpu => gpu(scenery),
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

/// Only where there is a graphics processor, and not software in its place.
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
