//! What a server remembers for those who watch: who may, how many do, and the recording that was looked at last.

mod evaluations;
mod key;
mod recording_reader;

pub use evaluations::KnownEvaluations;
pub use key::{Host, WatchKey, Watcher};
pub use recording_reader::{RECORDING, RecordingReader, no_recording, unreadable};

/// How many pages may watch at once.
pub const MAX_WATCHERS: usize = 64;
