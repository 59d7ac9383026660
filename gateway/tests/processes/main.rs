//! Tests of the program in a separate process: stopped, killed, resumed, on a full disk, with its log and its
//! information about itself.

mod agents;
mod command_line;
mod evaluations;
mod foxglove;
mod killed;
mod logs;
mod people;
mod reports;
mod server;
#[path = "../../../tests/src/skipped.rs"]
mod skipped;
mod tls;
mod without_space;

pub use server::{Delays, Server, hangups_are_ignored, partials};
