//! Tests of the server from the callers' side: its routes, its access control, and its refusals.

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
