//! Tandem's gateway: episodes of the simulator behind HTTP, and the command line around it.
//!
//! One request: [`routes`] reads it, [`table`] finds the episode, [`episode_thread`] hands the typed call to the thread
//! that owns the world, and [`problem`] turns every refusal into RFC 9457 problem details.

pub mod bench;
pub mod cli;
pub mod demo;
pub mod episode_thread;
pub mod evaluate;
pub mod http_caller;
pub mod mcp;
pub mod problem;
pub mod request;
pub mod routes;
pub mod run_folder;
pub mod seeds;
pub mod server;
pub mod settings;
pub mod table;
