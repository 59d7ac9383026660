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
    /// Centre and radius of a sphere around each part, in its mesh's frame.
    pub bounds: Vec<(Vector, f32)>,
    /// Of each part.
    pub linear_rgb: Vec<Vector>,
}

impl Prepared {
    pub(super) fn new(scenery: Scenery) -> Prepared {
        let (mut first, mut owner) = (Vec::with_capacity(scenery.parts.len()), Vec::new());
        for (number, part) in scenery.parts.iter().enumerate() {
            first.push(owner.len() as u32);
            owner.resize(owner.len() + part.mesh.triangles.len(), number as u32);
        }
        Prepared {
            first,
            owner,
            bounds: scenery.parts.iter().map(|part| part.mesh.bounds()).collect(),
            linear_rgb: scenery.parts.iter().map(|part| linear(part.rgb)).collect(),
            scenery,
        }
    }

    /// What a picture's ids show for a triangle.
    pub(super) fn id(&self, triangle: u32) -> u32 {
        self.scenery.parts[self.owner[triangle as usize] as usize].id
    }
}
