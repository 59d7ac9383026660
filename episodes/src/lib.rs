//! Episodes: tasks and their phases, budgets, grasp detection, and the session that runs tool calls on a world.

pub mod bench;
mod convert;
mod describe;
mod error;
pub mod evaluation;
pub mod experts;
pub mod facts;
mod grasp;
mod instructions;
mod motion;
mod observe;
mod phases;
mod plan;
mod protocol;
mod recorder;
mod report;
mod results;
mod run_files;
mod scorekeeper;
mod session;
mod strip;
pub mod tasks;

pub use describe::task_list;
pub use error::EpisodeError;
pub use facts::Facts;
pub use instructions::{Instructions, InstructionsError};
pub use protocol::{Clock, Rules, monotonic, rules};
pub use recorder::Recorder;
pub use results::{EpisodeResult, OutputError};
pub use run_files::RunFiles;
pub use session::{Checkpoint, Session};
pub use tandem_sim::{LocomotionChoice, SimError};
