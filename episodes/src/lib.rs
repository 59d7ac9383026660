//! Episodes: tasks and their phases, budgets, grasp detection, and the session that runs tool calls on a world.

pub mod bench;
mod commands;
mod convert;
mod describe;
mod error;
pub mod evaluation;
mod fingerprint;
mod instructions;
mod output;
pub mod players;
mod protocol;
mod recording;
mod reports;
mod scoring;
mod session;
mod spec;
pub mod tasks;

pub use describe::task_list;
pub use error::{CheckpointError, EpisodeError};
pub use instructions::{Instructions, InstructionsError};
pub use output::OutputError;
pub use protocol::{Rules, rules};
pub use recording::{RecordedCall, Recorder, Recording, RecordingError};
pub use reports::EpisodeResult;
pub use scoring::{A, B, Done, Facts, Grip, ObjectFacts, Phase, RobotFacts, Scored, Scores};
pub use session::{Checkpoint, Clock, RunFiles, Session, monotonic};
pub use spec::{Controller, EpisodeSpec, RendererKind, RobotFile, Start};
pub use tandem_sim::{BaseLimits, LocomotionChoice, SimError};
