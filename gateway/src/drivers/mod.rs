//! Policies that are not in the episode's process: how they reach it.

mod http_episode;

pub use http_episode::HttpEpisode;
