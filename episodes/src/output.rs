//! How files of an episode are written, and why that can fail.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// Why a file of a run folder could not be written.
#[derive(Debug, thiserror::Error)]
pub enum OutputError {
    #[error("cannot write {}: {source}; give a folder on a disk with space that may be written to", path.display())]
    Io { path: PathBuf, source: io::Error },
    #[error("the recording {} failed: {source}", path.display())]
    Mcap { path: PathBuf, source: mcap::McapError },
    #[error("a record of the episode cannot be written as JSON: {0}")]
    Json(#[from] serde_json::Error),
    #[error("a message of the recording cannot be encoded: {0}")]
    Encode(#[source] Box<dyn std::error::Error + Send + Sync>),
}

/// Writes a file under another name first and renames it when it is complete: a reader sees the whole of it or nothing.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<(), OutputError> {
    let mut partial = path.to_path_buf().into_os_string();
    partial.push(".partial");
    fs::write(&partial, bytes)
        .and_then(|()| fs::rename(&partial, path))
        .map_err(|source| OutputError::Io { path: path.into(), source })
}
