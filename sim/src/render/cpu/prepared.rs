//! A scenery with what drawing wants to know of it and what never changes.

use rapier3d::math::Vector;

use super::srgb::linear;
use crate::render::Scenery;

pub(super) struct Prepared {
    pub scenery: Scenery,
    /// Number of the first triangle of each part: triangles are counted part by part.
    pub first: Vec<u32>,
    /// Part of each triangle.
    pub owner: Vec<u32>,
    /// What a picture's ids show for each triangle.
    pub ids: Vec<u32>,
    /// Centre and radius of a sphere around each part, in its mesh's frame.
    pub bounds: Vec<(Vector, f32)>,
    /// Of each part.
    pub linear_rgb: Vec<Vector>,
}

impl Prepared {
    pub(super) fn new(scenery: Scenery) -> Prepared {
        let (mut first, mut owner, mut ids) = (Vec::new(), Vec::new(), Vec::new());
        for (number, part) in scenery.parts.iter().enumerate() {
            first.push(owner.len() as u32);
            let end = owner.len() + part.mesh.triangles.len();
            owner.resize(end, number as u32);
            ids.resize(end, part.id);
        }
        Prepared {
            first,
            owner,
            ids,
            bounds: scenery.parts.iter().map(|part| part.mesh.bounds()).collect(),
            linear_rgb: scenery.parts.iter().map(|part| linear(part.rgb)).collect(),
            scenery,
        }
    }
}
