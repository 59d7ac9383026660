//! Episodes: tasks and their phases, budgets, grasp detection, and the session that runs tool calls on a world.

mod error;
pub mod facts;
mod grasp;
mod phases;
mod protocol;
pub mod tasks;

pub use error::EpisodeError;
pub use facts::Facts;
pub use protocol::{Clock, Rules, monotonic, rules};
