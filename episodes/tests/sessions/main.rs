//! Sessions on real physics.

mod after_the_end;
mod at_rest;
mod checkpoints;
mod commands;
mod common;
mod disclosure;
mod films;
mod hand_force;
mod hands;
mod recordings;
mod renderers;
mod replays;
mod scenes;
