//! The episodes that a server holds: their table, their threads and their recording folders. The module does
//! not depend on the protocol by which callers reach it.

#[cfg(test)]
mod absurd_robot;
mod answer;
mod brought_back;
mod durable;
mod episode;
mod error;
mod hosted_episode;
mod idempotency_cache;
mod image_links;
mod run_folder;
mod table;
mod team;
#[cfg(test)]
pub mod tests;

#[cfg(test)]
pub use absurd_robot::write_absurd_robot;
pub use answer::{Answer, RefusedCall};
pub use durable::LiveFolder;
pub use episode::{EpisodeMetrics, EpisodeThread, LiveWatch, PanicGuard};
pub use error::HostingError;
pub use hosted_episode::{Caller, HostedEpisode};
pub use idempotency_cache::IdempotentReply;
pub use run_folder::{episode_name, look_at_runs_folder, try_runs_folder};
pub use table::{EpisodeTable, Guests, Purpose};
pub use team::{
    CollectedEpisode, Collection, CollectionProgress, CollectionStage, Driver, DriverRequest, Setpoint,
};
