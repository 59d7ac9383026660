//! Policies that are not in the episode's process: how they reach it, or it them.

mod agent;
mod http_episode;
mod program;
mod remote;

pub use agent::{AgentError, AgentLoop};
pub use http_episode::HttpEpisode;
pub use program::Program;
pub use remote::{MapError, PRESETS, PolicyMap, PolicyProtocol, RemoteError, RemotePolicy, preset, try_map};
