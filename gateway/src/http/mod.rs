//! Episodes over HTTP: REST under `/v1`, MCP at `/mcp`, and problem details for whatever is refused.

mod access;
mod app;
mod connections;
mod encoding;
mod gate;
mod key;
mod mcp;
mod problem;
mod request;
mod routes;
mod server;
#[cfg(test)]
mod tests;

pub use server::Server;
