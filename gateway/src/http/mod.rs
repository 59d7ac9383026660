//! Episodes over HTTP: REST under `/v1`, MCP at `/mcp`, and problem details for whatever is refused.

mod access;
mod app;
mod connections;
mod counted;
mod docs;
mod encoding;
mod envelope;
mod gate;
#[cfg(test)]
mod hostile;
mod key;
mod limits;
mod mcp;
mod problem;
mod prompt;
mod request;
mod routes;
mod server;
#[cfg(test)]
mod tests;

pub use server::{Server, shutdown_signal};
