//! Shared helpers of the end-to-end tests: a server in this process on a free port, and a client that returns
//! every response, including errors.

mod server;
mod skipped;

pub use server::{Answer, TestServer};
pub use skipped::skipped;
