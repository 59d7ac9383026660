//! What an episode leaves for people to look at: a page and a strip of pictures.

pub mod moments;
mod page;
pub mod strip;

pub use moments::{KeyMoment, LabelledPicture};
pub use page::{CallCounts, EpisodePage, PAGE_FILE, SaidWords};
pub use strip::{CELL_HEIGHT, CELL_WIDTH, STRIP_FILE};
