//! Export of a recording's moving geometry to files that other renderers read.

mod gltf;
mod moving;
mod surfaces;
mod usd;

use std::path::{Path, PathBuf};

use tandem_sim::render::PictureError;

use super::ReplayError;
use crate::output::{OutputError, write_whole};
use crate::recording::Recording;
use moving::MovingScene;

/// Format of an export, by the file's extension.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ExportFormat {
    /// Binary glTF 2.0, with all images in the file.
    Glb,
    /// USD as text, with its images in a folder beside it.
    Usda,
}

/// Reason why a recording cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    #[error("{} has no format that can be written; give a file that ends in .glb or .usda", .0.display())]
    Format(PathBuf),
    #[error("{} would have more than 4 GiB; lower --rate, or give a file that ends in .usda", .0.display())]
    Size(PathBuf),
    #[error(transparent)]
    Picture(#[from] PictureError),
    #[error(transparent)]
    Output(#[from] OutputError),
    #[error(transparent)]
    Replay(Box<ReplayError>),
}

impl From<ReplayError> for ExportError {
    fn from(error: ReplayError) -> ExportError {
        ExportError::Replay(error.into())
    }
}

impl ExportFormat {
    /// Returns the format for the file's extension.
    ///
    /// # Errors
    ///
    /// If no format has this extension; the text lists the extensions.
    pub fn of(path: &Path) -> Result<ExportFormat, ExportError> {
        match path.extension().and_then(|extension| extension.to_str()) {
            Some("glb") => Ok(ExportFormat::Glb),
            Some("usda") => Ok(ExportFormat::Usda),
            _ => Err(ExportError::Format(path.into())),
        }
    }
}

/// Writes the room, robots and objects of a recording with their motion, cameras and lights. Returns the
/// number of moments. `rate_hz` is the number of moments per second of simulated time.
///
/// # Errors
///
/// If the format is unknown, the recording cannot be replayed, or a file cannot be written.
pub fn export(recording: &Recording, rate_hz: u32, path: &Path) -> Result<usize, ExportError> {
    let format = ExportFormat::of(path)?;
    let scene = MovingScene::of(recording, rate_hz)?;
    match format {
        ExportFormat::Glb => {
            let file = gltf::file(&scene)?.ok_or_else(|| ExportError::Size(path.into()))?;
            write_whole(path, &file)?;
        }
        ExportFormat::Usda => usd::write(&scene, path)?,
    }
    Ok(scene.moments)
}
