//! State that a server keeps for watchers: their key, their number, and the recording that was viewed
//! last.

mod evaluations;
mod key;
mod recording_reader;

pub use evaluations::KnownEvaluations;
pub use key::{Host, WatchKey, Watcher};
pub use recording_reader::{RECORDING, RecordingReader, no_recording, unreadable};

/// Maximum number of pages that watch at once.
pub const MAX_WATCHERS: usize = 64;
