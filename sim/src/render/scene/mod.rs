//! What is drawn: the meshes and colours of a world, where a step has put them, and the cameras that look at them.

pub mod accents;
pub mod bend;
pub mod camera;
pub mod cameras;
pub mod mesh;
pub mod prepared;
pub mod scenery;
