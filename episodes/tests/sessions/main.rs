//! Sessions on real physics.

mod at_rest;
mod checkpoints;
mod commands;
mod common;
mod disclosure;
mod films;
mod hand_force;
mod recordings;
mod replays;
