//! Tests of worlds through the public interface: physics and images.

mod allocation;
mod falls;
mod hand_forces;
mod images;
mod motors;
mod odometry;
mod peer_scenes;
mod render;
mod world;
