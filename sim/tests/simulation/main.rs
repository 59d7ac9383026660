//! Worlds from outside: physics, walking and pictures.

mod allocation;
#[cfg(feature = "gpu")]
mod gpu;
mod locomotion;
mod odometry;
mod peer_scenes;
mod render;
mod world;
