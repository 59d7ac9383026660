//! Baked light in GPU memory: ambient cubes of parts and of the room, and the texels of its light maps.

use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::{BakedLight, LightCube, LightTexel, PatchLight};
use crate::render::{Carrier, PlacedScenery};

/// Number of words about light in `Face`.
pub(super) const FACE_NUMBERS: usize = 12;
/// Number of sides of a cube.
const SIDES: u32 = 6;
/// Kinds of light in `Face`.
const ON_MAP: u32 = 1;
const ON_CUBE: u32 = 2;
const ON_PART: u32 = 3;

/// Returns all values of `baked`; the cubes of parts are not set.
pub(super) fn numbers(prepared: &Prepared) -> Vec<LightTexel> {
    let Some(baked) = &prepared.baked else { return Vec::new() };
    let mut numbers = vec![LightTexel::default(); prepared.scenery.parts.len() * SIDES as usize];
    numbers.extend_from_slice(baked.cubes.as_flattened());
    numbers.extend_from_slice(&baked.texels);
    numbers
}

/// Returns the words of `Face` about the light of a patch.
pub(super) fn face_numbers(prepared: &Prepared, patch: u32) -> [u32; FACE_NUMBERS] {
    let mut numbers = [0; FACE_NUMBERS];
    let Some(baked) = &prepared.baked else { return numbers };
    let first_cube = prepared.scenery.parts.len() as u32 * SIDES;
    let light = match baked.patches.get(patch as usize) {
        Some(PatchLight::Map(number)) => {
            let map = &baked.maps[*number as usize];
            numbers[..8].copy_from_slice(map.axes_values.map(|row| row.map(f32::to_bits)).as_flattened());
            let first_texel = first_cube + baked.cubes.len() as u32 * SIDES;
            [ON_MAP, first_texel + map.first, map.width, map.height]
        }
        Some(PatchLight::Cube(number)) => [ON_CUBE, first_cube + number * SIDES, 0, 0],
        None => [ON_PART, 0, 0, 0],
    };
    numbers[8..].copy_from_slice(&light);
    numbers
}

/// Returns the ambient cubes of all parts in a state; those of the room's parts are unused.
pub(super) fn part_cubes(baked: &BakedLight, prepared: &Prepared, placed: &PlacedScenery) -> Vec<LightCube> {
    let parts = prepared.scenery.parts.iter().zip(&placed.world_from_mesh).enumerate();
    parts
        .map(|(number, (part, pose))| match part.carrier {
            Carrier::Room => LightCube::default(),
            Carrier::Link { .. } | Carrier::Object(_) => {
                baked.cube(*pose * prepared.geometry(number).bounds.0)
            }
        })
        .collect()
}
