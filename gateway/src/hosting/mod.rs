//! The episodes that a server holds: their table, the thread of each, and the folder that each is recorded into.
//! Nothing here knows how callers reach it.

mod answer;
mod caller;
mod episode_thread;
mod error;
mod guarded;
mod hosted;
mod kept;
mod run_folder;
mod table;
mod tally;
mod team;
#[cfg(test)]
mod tests;
mod work;

pub use answer::Answer;
pub use caller::Caller;
pub use episode_thread::EpisodeThread;
pub use error::HostingError;
pub use hosted::{Hosted, Request};
pub use kept::Once;
pub use table::EpisodeTable;
