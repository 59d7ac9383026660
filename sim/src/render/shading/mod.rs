//! What renderers agree on: light, textures, and arithmetic on several points at once.

pub mod affine;
pub mod light;
pub mod pattern;
pub mod rows;
