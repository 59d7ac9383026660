//! The program itself: stopped, killed, and on a full disk.

mod killed;
mod logs;
mod resumed;
mod server;
mod stopped;
mod without_space;

pub use server::{Delays, Server, partials};
