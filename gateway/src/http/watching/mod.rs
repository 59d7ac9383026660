//! State that a server keeps for watchers: their key, their maximum number, the recording viewed last, images
//! on surfaces, and the pictures of tasks.

mod evaluations;
mod key;
mod recording_reader;
mod task_pictures;
mod textures;

pub use evaluations::KnownEvaluations;
pub use key::{Host, WatchKey, Watcher};
pub use recording_reader::{RECORDING, RecordingReader, no_recording, unreadable};
pub use task_pictures::TaskPictures;
pub use textures::KnownTextures;

/// Maximum number of pages that watch at the same time.
pub const MAX_WATCHERS: usize = 64;
