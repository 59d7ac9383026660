//! Policies that are not in the episode's process: how they reach it, or it them.

mod http_episode;
mod program;
mod python;
mod remote;

pub use http_episode::HttpEpisode;
pub use program::Program;
pub use python::{PythonError, PythonModule, PythonPart};
pub use remote::{MapError, PRESETS, PolicyMap, PolicyProtocol, RemoteError, RemotePolicy, preset, try_map};
