//! Flags that several subcommands share.

mod agent;
mod episode;
mod policy;

pub use agent::AgentFlags;
pub use episode::{EpisodeFlags, LocomotionFlag, RendererFlag, SceneFlag, Seeds, SensingFlags};
pub use policy::PolicyFlags;
