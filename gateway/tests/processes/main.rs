//! The program in a process of its own: stopped, killed, resumed, on a full disk, and what it logs.

mod logs;
mod resumed;
mod server;
mod signals;
mod without_space;

pub use server::{Delays, Server, partials};
