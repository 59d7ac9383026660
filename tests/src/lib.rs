//! What the end-to-end tests share: a server in this process on a free port, and a client that keeps whatever comes back.

mod server;
mod skipped;

pub use server::{Answer, TestServer};
pub use skipped::skipped;
