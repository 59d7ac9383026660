//! Episodes: tasks and their phases, budgets, grasp detection, and the session that runs tool calls on a world.

pub mod bench;
mod commands;
mod convert;
mod describe;
mod error;
pub mod evaluation;
mod fingerprint;
mod instructions;
mod observation;
mod output;
pub mod players;
mod protocol;
mod recording;
pub mod replay;
pub mod reports;
pub mod results;
mod scoring;
mod session;
mod spec;
pub mod statistics;
pub mod tasks;

pub use commands::{Called, OperatorCommand, own as own_call};
pub use describe::{brief, task_list};
pub use error::{CheckpointError, EpisodeError, SceneError};
pub use instructions::{Instructions, InstructionsError};
pub use observation::{Picture, RobotObservation, RobotView, TeamObservation};
pub use output::{OutputError, create_new_private_folder, create_private_folder, html, write_whole};
pub use protocol::{Rules, rules};
pub use recording::{
    RecordedCall, RecordedCheckpoint, Recorder, Recording, RecordingError, RecoverError, Recovered,
    Visibility, recover,
};
pub use results::RESULT_FILE;
pub use scoring::{A, B, C, Done, Facts, Grip, Milestone, ObjectFacts, Phase, RobotFacts, Scores, StepScore};
pub use session::{Checkpoint, Clock, RunFiles, RunFolder, Session, monotonic};
pub use spec::{Controller, EpisodeSpec, PhaseStart, RobotFile, SceneFile, Start};
pub use tandem_sim::{BaseLimits, LocomotionChoice, SimError, joint_names, render::RendererKind};
