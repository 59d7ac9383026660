//! Tests of sessions with real physics.

mod at_rest;
mod cameras;
mod checkpoints;
mod commands;
mod common;
mod felt;
mod files;
mod films;
mod journals;
mod operators;
mod plans;
mod recordings;
mod replays;
#[path = "../../../tests/src/skipped.rs"]
mod skipped;
mod stress;
mod told;
mod transcripts;
