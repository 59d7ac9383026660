//! Sessions on real physics.

mod at_rest;
mod checkpoints;
mod commands;
mod common;
mod disclosure;
mod hand_force;
mod recordings;
mod renderers;
