//! Ways to drive an episode from outside its thread.

mod http_episode;

pub use http_episode::{HttpEpisode, HttpError};
