//! Flags that several subcommands share.

mod episode;
mod policy;

pub use episode::{EpisodeFlags, LocomotionFlag, RendererFlag, SceneFlag, Seeds, SensingFlags};
pub use policy::PolicyFlags;
