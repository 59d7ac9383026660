//! Sheets as shading wants them in one state of the world.

use rapier3d::math::{Matrix, Vector};

use crate::render::scene::prepared::{Prepared, Sheet};
use crate::render::shading::affine::Affine;
use crate::render::{Carrier, Pattern, PlacedScenery};

/// A sheet in the world.
#[derive(Clone, Copy)]
pub(super) struct Facet {
    /// The normal at a point p, of any length, is `normal + slope_1_m * p`.
    pub normal: Vector,
    pub slope_1_m: Option<Matrix>,
    pub linear_rgb: [Vector; 2],
    pub pattern: Pattern,
    pub pattern_from_world: Affine,
    /// Whether it is the room's, and darkened by what stands on it.
    pub carries: bool,
}

/// The facets of a state, by their sheets' numbers.
pub(super) fn place(facets: &mut Vec<Facet>, prepared: &Prepared, placed: &PlacedScenery) {
    let rotations: Vec<_> =
        placed.world_from_mesh.iter().map(|pose| Matrix::from_quat(pose.rotation)).collect();
    facets.clear();
    facets.extend(prepared.sheets.iter().map(|sheet| Facet::new(prepared, placed, &rotations, sheet)));
}

impl Facet {
    fn new(prepared: &Prepared, placed: &PlacedScenery, rotations: &[Matrix], sheet: &Sheet) -> Facet {
        let number = sheet.part as usize;
        let (part, pose) = (&prepared.scenery.parts[number], placed.world_from_mesh[number]);
        let rotation = rotations[number];
        let slope_1_m = sheet.bend.slope_1_m.map(|slope_1_m| rotation * slope_1_m * rotation.transpose());
        let at_origin = slope_1_m.map_or(Vector::ZERO, |slope_1_m| slope_1_m * pose.translation);
        Facet {
            normal: rotation * sheet.bend.normal - at_origin,
            slope_1_m,
            linear_rgb: prepared.linear_rgb[number],
            pattern: part.pattern,
            pattern_from_world: part.pattern.frame(pose, prepared.grain[number]),
            carries: part.carrier == Carrier::Room,
        }
    }
}
