//! What an episode leaves for people to look at: a page and a strip of pictures.

mod page;
mod strip;

pub use page::{CallCounts, EpisodePage, PAGE_FILE};
pub use strip::{CELL_HEIGHT, CELL_WIDTH, KeyMoment, LabelledFrame, STRIP_FILE, png};
