//! The episodes that a server holds: their table, the thread of each, and the folder that each is recorded into.
//! Nothing here knows how callers reach it.

mod episode_thread;
mod error;
mod run_folder;
mod table;

pub use episode_thread::EpisodeThread;
pub use error::HostingError;
pub use table::EpisodeTable;
