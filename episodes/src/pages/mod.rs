//! Output of an episode for people: a page and a strip of images.

pub mod moments;
mod page;
mod sides;
pub mod strip;

pub use moments::{KeyMoment, LabelledPicture};
pub use page::PAGE_FILE;
pub(crate) use page::{CallCounts, EpisodePage, SaidWords};
pub use sides::{SIDES_FILE, draw_sides};
pub use strip::STRIP_FILE;
pub(crate) use strip::{CELL_HEIGHT, CELL_WIDTH};
