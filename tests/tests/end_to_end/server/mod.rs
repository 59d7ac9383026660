//! The server as callers meet it: its routes, who is let in, and what is refused.

mod access;
mod assistance;
mod bad_input;
mod crowd;
mod door;
mod hints;
mod listing;
mod mcp;
mod operations;
mod repeats;
mod rest;
