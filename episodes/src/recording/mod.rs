//! Recordings: an episode as MCAP with Foxglove's well-known schemas, so that it can be watched and plotted in Foxglove, and
//! read back step by step.
//!
//! Log times are simulated time. Frames: `world`, `A/pelvis` and every other link of robot A as `A/<link>`, its camera as
//! `A/egocentric`, objects by name. Numbers that have no well-known schema are JSON with a JSON Schema. `/steps` holds each
//! [`tandem_sim::Step`] as it was, bit for bit, from the state before the first one on; everything else is for people.
//!
//! All that a replay needs is there: what the episode is, the build, each tool call with what the policy's clock was
//! charged, the hash of the whole state after every step, and as attachments checkpoints of where the policy took over and
//! where every later phase begins.
//!
//! The file is `episode.mcap.partial` until [`Recorder::finish`] renames it, so an `episode.mcap` is always complete. A
//! recorder that is dropped earlier still writes the index; one whose process is killed leaves whole chunks without an index,
//! which [`recover`] adds. Whoever reads a recording has every byte of it checked first ([`Recording::read`]).

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
pub use mcap_file::Visibility;
pub use read::{MAX_RECORDING_BYTES, RecordedCall, RecordedCheckpoint, Recording, RecordingError};
pub use recover::{LeftOut, RecoverError, Recovered, recover};
pub use thread::RecorderThread;
pub use topics::messages::{
    CallMoment, CallOutcome, CallerRecord, ShownPicture, ToolCallMessage, ToolCallRecord, state_hash_text,
};
pub use topics::notes::NoteMessage;
pub use transcript::TranscriptEntry;
pub use write::{Recorder, RecordingHeader};

/// What the checkpoint is called that an episode began with, where that is not its task's own beginning.
pub const BEGIN: &str = "begin";

/// Name of the attachment that is the checkpoint of a phase's beginning, or of [`BEGIN`].
fn checkpoint_name(of: &str) -> String {
    format!("{of}.checkpoint")
}
