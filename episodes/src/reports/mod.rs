//! What an episode leaves for people to read: its result, a page, a strip of pictures.

mod episode_page;
mod results;
mod strip;

pub use episode_page::{CallCounts, EpisodePage, escape};
pub use results::{RESULT_FILE, write_result};
pub use strip::{CELL_HEIGHT, CELL_WIDTH, Moment, View, png};
