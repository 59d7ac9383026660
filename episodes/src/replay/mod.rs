//! Replays of recordings: simulated again and compared step by step, or rendered again by any camera.

mod export;
mod look_back;
mod phase_trace;
mod pictures;
mod scene;
mod verify;
mod video;

pub use export::{ExportError, ExportFormat, export};
pub use look_back::RecordedEpisode;
pub use phase_trace::{Closest, ConditionTrace, Held, Moment, PartTrace, PhaseTrace};
pub use pictures::{DrawnPictures, PicturesError, PicturesPlan, draw_all};
pub use scene::{EpisodeCamera, EpisodeRenderer, PictureSize, start_picture};
pub use verify::{Difference, Verdict, Verification, verify};
pub use video::{FilmPlan, ShortFilm, VideoError, VideoFormat, film, short_film};

use crate::EpisodeError;
use crate::recording::RecordingError;

/// Reason why a recording cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum ReplayError {
    #[error(transparent)]
    Recording(#[from] RecordingError),
    #[error(transparent)]
    Episode(#[from] EpisodeError),
    #[error("call {number} of the recording is no tool call of this build: {source}")]
    Call { number: usize, source: Box<EpisodeError> },
}
