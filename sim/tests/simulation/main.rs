//! Worlds from outside: physics, walking and images.

mod allocation;
mod falls;
mod hand_forces;
mod images;
mod locomotion;
mod motors;
mod odometry;
mod peer_scenes;
mod render;
mod robots;
mod world;
