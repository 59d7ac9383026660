//! Flags that several subcommands share.

mod episode;
mod policy;
mod seeds;

pub use episode::{EpisodeFlags, LocomotionFlag, RendererFlag, SceneFlag};
pub use policy::PolicyFlags;
pub use seeds::Seeds;
