//! Worlds from outside: physics, walking and pictures.

mod allocation;
mod falls;
mod locomotion;
mod odometry;
mod peer_scenes;
mod render;
mod world;
