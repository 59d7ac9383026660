//! What episodes came to, as files and as counts.

mod phase_level;
mod played;
mod result_file;

pub use phase_level::{PhaseLevel, PhaseRate};
pub use played::{EPISODES, Played, PolicyCard, missed};
pub use result_file::{RESULT_FILE, write_result};
