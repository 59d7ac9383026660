//! Flags that several subcommands share.

mod agent;
mod episode;
mod policy;
mod world;

pub use agent::AgentFlags;
pub use episode::{EpisodeFlags, Seeds};
pub use policy::PolicyFlags;
pub use world::{LocomotionFlag, SensingFlags, WorldFlags};
