//! Episodes over HTTP: REST under `/v1`, MCP at `/mcp`, and problem details for every refusal.

mod app;
mod body;
mod encoding;
mod gate;
#[cfg(test)]
mod hostile;
mod mcp;
mod pages;
mod problem;
mod rest;
mod router;
mod server;
#[cfg(test)]
mod tests;
mod watching;

pub use pages::{operate::operator_link, qr::qr_text};
pub use server::{Server, shutdown_signal};
