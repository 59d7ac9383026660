//! Tests of episodes with scenes and robots from files.

mod houses;
mod phases;
mod robots;
mod scenes;
