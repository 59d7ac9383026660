//! Colours that tell robots apart.

use crate::mjcf::Geom;

/// By robot, in place of the material `accent` of the robot's file.
const ACCENTS: [[f32; 4]; 3] = [[0.12, 0.35, 0.85, 1.0], [0.95, 0.48, 0.08, 1.0], [0.15, 0.62, 0.28, 1.0]];
const ACCENT_MATERIAL: &str = "accent";

/// Colour of a geom of robot number `robot`. Robots differ in their accents alone, so that partners can be told apart.
pub fn robot_rgba(geom: &Geom, robot: usize) -> [f32; 4] {
    match geom.material.as_deref() {
        Some(ACCENT_MATERIAL) => ACCENTS[robot % ACCENTS.len()],
        _ => geom.rgba,
    }
}
