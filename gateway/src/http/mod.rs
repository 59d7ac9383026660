//! Episodes over HTTP: REST under `/v1`, MCP at `/mcp`, and problem details for whatever is refused.

mod app;
mod connections;
mod gate;
mod mcp;
mod problem;
mod request;
mod routes;
mod server;
#[cfg(test)]
mod tests;

pub use server::{Server, shutdown_signal};
