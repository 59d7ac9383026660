//! Output of an episode for people: a page and a strip of images.

pub mod moments;
mod page;
pub mod strip;

pub use moments::{KeyMoment, LabelledPicture};
pub use page::{CallCounts, EpisodePage, PAGE_FILE, SaidWords};
pub use strip::{CELL_HEIGHT, CELL_WIDTH, STRIP_FILE};
