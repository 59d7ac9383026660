//! Tests of episodes with scenes and robots from files.

mod phases;
mod robots;
mod scenes;
