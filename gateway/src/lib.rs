//! Tandem's gateway: episodes of the simulator behind HTTP, and the command line.
//!
//! The path of a request: [`http`] parses it. [`hosting`] finds the episode and passes the typed call to
//! the thread that owns its world. `http/problem` turns every refusal into RFC 9457 problem details.

pub mod cli;
pub mod commands;
pub mod drivers;
pub mod hosting;
pub mod http;
mod live_view;
pub mod metrics;
pub mod settings;
pub mod token;
