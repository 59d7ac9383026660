//! The episodes that a server holds: their table, the thread of each, and the folder that each is recorded into.
//! Nothing here knows how callers reach it.

#[cfg(test)]
mod absurd_robot;
mod answer;
mod episode_thread;
mod error;
mod hosted_episode;
mod idempotency_cache;
mod onlookers;
mod panic_guard;
mod run_folder;
mod table;
mod team;
#[cfg(test)]
mod tests;

#[cfg(test)]
pub use absurd_robot::write_absurd_robot;
pub use answer::{Answer, RefusedCall};
pub use episode_thread::EpisodeThread;
pub use error::HostingError;
pub use hosted_episode::{Caller, HostedEpisode};
pub use idempotency_cache::IdempotentReply;
pub use onlookers::LiveWatch;
pub use panic_guard::{EpisodeMetrics, PanicGuard};
pub use run_folder::{episode_name, look_at_runs_folder, try_runs_folder};
pub use table::{EpisodeTable, Purpose};
pub use team::{
    CollectedEpisode, Collection, CollectionProgress, CollectionStage, Driver, PartnerPolicy, Wish,
};
