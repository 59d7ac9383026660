//! Policies outside the episode's process, and the ways in which they connect to it.

mod http_episode;
mod interruption;
mod people;
mod program;
mod python;

use std::{fs, io, path::Path};

use tandem_evaluation::policies::PlayError;
use tandem_tools_spec::ResultReply;

use crate::hosting::{EpisodeThread, HostingError};

pub use http_episode::HttpEpisode;
pub use interruption::with_last_words;
pub use people::People;
pub use program::Program;
pub use python::{PythonError, PythonModule, PythonPart, interpreter};

/// Removes the result that an interrupted run has left.
fn remove_old_result(path: &Path) -> Result<(), PlayError> {
    match fs::remove_file(path) {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(lost("an old result stays", error)),
        _ => Ok(()),
    }
}

/// Returns the result of an episode that a program has closed in any way. The result comes from the server,
/// because the program may have written to the episode's folder.
fn own_result(episode: &EpisodeThread) -> Result<ResultReply, PlayError> {
    let result = episode.result().cloned();
    result.ok_or_else(|| PlayError::Lost("no result: the episode was not closed in time".into()))
}

fn lost(what: &str, error: io::Error) -> PlayError {
    PlayError::Lost(format!("{what}: {error}"))
}

impl From<HostingError> for PlayError {
    fn from(error: HostingError) -> PlayError {
        match error {
            HostingError::Episode(error) => PlayError::Episode(error),
            error => PlayError::Lost(error.to_string()),
        }
    }
}
