//! MJCF files that are kept by path and hash, because they may refer to meshes and images.

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use tandem_sim::{SimError, mjcf::Document};

use crate::error::SceneError;

/// An MJCF file of a scene or an object, with the files that it refers to.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SceneFile {
    pub path: PathBuf,
    /// Hash of the content when the episode was planned; see [`Document::fingerprint`].
    pub xxh3: String,
}

impl SceneFile {
    /// Returns the scene that a file currently contains.
    pub fn of(path: &Path) -> Result<SceneFile, SimError> {
        SceneFile::with_approximations(path).map(|(scene, _)| scene)
    }

    /// Returns the scene that a file currently contains, and each deviation from MuJoCo in a line.
    pub fn with_approximations(path: &Path) -> Result<(SceneFile, Vec<String>), SimError> {
        let document = Document::read(path)?;
        let xxh3 = fingerprint(&document);
        // A replay may run in another folder.
        let path = std::path::absolute(path).unwrap_or_else(|_| path.into());
        Ok((SceneFile { path, xxh3 }, document.approximations().to_vec()))
    }

    /// Reads the scene. Its file must be unchanged.
    ///
    /// # Errors
    ///
    /// If the file cannot be read, or [`SceneError::Changed`].
    pub fn load(&self) -> Result<Document, SceneError> {
        let document = Document::read(&self.path)?;
        let now = fingerprint(&document);
        match now == self.xxh3 {
            true => Ok(document),
            false => Err(SceneError::Changed { path: self.path.clone(), was: self.xxh3.clone(), now }),
        }
    }
}

fn fingerprint(document: &Document) -> String {
    format!("{:016x}", document.fingerprint())
}
