//! The recording that was looked at last, in memory.

use std::{
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use axum::http::StatusCode;
use tandem_episodes::replay::RecordedEpisode;

use crate::http::problem::ApiError;

/// What a recording is called in an episode's folder.
pub const RECORDING: &str = "episode.mcap";

/// The recording that was looked at last: a page asks for many pictures of one.
#[derive(Clone, Default)]
pub struct LastOpened(Arc<Mutex<Option<OpenedRecording>>>);

/// A recording in memory, and which file it was read from when.
struct OpenedRecording {
    path: PathBuf,
    changed: SystemTime,
    episode: Arc<RecordedEpisode>,
}

impl std::fmt::Debug for LastOpened {
    fn fmt(&self, text: &mut std::fmt::Formatter) -> std::fmt::Result {
        text.write_str("LastOpened(..)")
    }
}

impl LastOpened {
    /// The recording in an episode's folder, read only where it is another one, or has changed.
    pub fn open(&self, folder: &Path) -> Result<Arc<RecordedEpisode>, ApiError> {
        let path = folder.join(RECORDING);
        let changed = fs::metadata(&path).and_then(|file| file.modified());
        let changed = changed.map_err(|_| no_recording(folder))?;
        let mut last = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(opened) = last.as_ref().filter(|opened| opened.path == path && opened.changed == changed)
        {
            return Ok(opened.episode.clone());
        }
        // One at a time: two pages that ask for the same wait for one reading.
        let episode = RecordedEpisode::read(&path).map(Arc::new).map_err(|error| unreadable(&error))?;
        *last = Some(OpenedRecording { path, changed, episode: episode.clone() });
        Ok(episode)
    }
}

/// The refusal where an episode has no such file.
pub fn no_recording(folder: &Path) -> ApiError {
    ApiError::NoRun { run: folder.file_name().unwrap_or_default().to_string_lossy().into_owned() }
}

/// The refusal where a recording cannot be used.
pub fn unreadable(error: &dyn std::error::Error) -> ApiError {
    let status = StatusCode::UNPROCESSABLE_ENTITY;
    ApiError::Protocol { status, detail: error.to_string() }
}
