//! Sessions on real physics.

mod at_rest;
mod checkpoints;
mod commands;
mod common;
mod films;
mod hands;
mod operators;
mod recordings;
mod replays;
mod scenes;
#[path = "../../../tests/src/skipped.rs"]
mod skipped;
mod told;
