//! Recordings: an episode as MCAP with Foxglove's well-known schemas. It can be watched and plotted in
//! Foxglove, and read back step by step.
//!
//! Log times are simulated time. Frames: `world`, `A/pelvis` and every other link of robot A as `A/<link>`,
//! its camera as `A/egocentric`, objects by name. Numbers that have no well-known schema are JSON with a
//! JSON Schema. `/steps` holds each [`tandem_sim::Step`] bit for bit, including the state before the first
//! one; everything else is for people.
//!
//! The file has all that a replay needs. It includes the episode's spec and build, each tool call with the
//! time charged to the policy's clock, and the hash of the whole state after every step. Its attachments
//! are checkpoints of the policy's start and of the beginning of every later phase.
//!
//! The file is `episode.mcap.partial` until [`Recorder::finish`] renames it, so an `episode.mcap` is always
//! complete. A recorder that is dropped earlier still writes the index. One whose process is killed leaves
//! whole chunks without an index, which [`recover`] adds. A reader checks every byte first
//! ([`Recording::read`]).

mod checked_file;
mod damage;
mod data_section;
mod mcap_file;
mod metadata;
mod read;
mod recover;
#[cfg(test)]
mod tests;
mod thread;
mod topics;
mod transcript;
mod write;

pub use damage::{Damage, Fault, FilePart};
pub use mcap_file::{LiveChannel, LiveRecording, LiveViewer, Visibility};
pub use read::{
    MAX_RECORDING_BYTES, RecordedCall, RecordedCheckpoint, RecordedSetpoints, Recording, RecordingError,
};
pub use recover::{LeftOut, RecoverError, Recovered, recover};
pub use thread::RecorderThread;
pub use topics::messages::{
    CallMoment, CallOutcome, CallerRecord, ShownPicture, ToolCallMessage, ToolCallRecord, state_hash_text,
};
pub use topics::notes::NoteMessage;
pub use transcript::TranscriptEntry;
pub use write::{Recorder, RecordingHeader};

/// Name of the checkpoint with which an episode began, unless it began at its task's own beginning.
pub const BEGIN: &str = "begin";

/// Returns the name of the attachment with the checkpoint of a phase's beginning, or of [`BEGIN`].
fn checkpoint_name(of: &str) -> String {
    format!("{of}.checkpoint")
}
