//! A scenery with precomputed constant data for drawing.

use std::collections::HashMap;

use rapier3d::math::Vector;

use super::bend::Bend;
use super::faces::Faces;
use crate::render::shading::lanes::Points;
use crate::render::shading::linear;
use crate::render::{Part, Pattern, Scenery, TriangleMesh};

/// Mark of a sample without a surface.
pub const NOTHING: u32 = u32::MAX;

pub struct Prepared {
    pub scenery: Scenery,
    /// Where corners of each part's triangles are. A mesh with flat faces names a place once for each triangle there; here it is named
    /// once.
    pub points: Vec<Points>,
    /// Each part's triangles, by the numbers of their corners' points.
    pub triangles: Vec<Vec<[u32; 3]>>,
    /// Planes of each part's triangles.
    pub faces: Vec<Faces>,
    pub sheets: Vec<Sheet>,
    /// The number of each triangle's sheet, with triangles counted part by part.
    pub sheet_of: Vec<u32>,
    /// Number of the first triangle of each part.
    first: Vec<usize>,
    /// Id in images of each sheet.
    ids: Vec<u32>,
    /// Centre and radius of a sphere around each part, in its mesh's frame.
    pub bounds: Vec<(Vector, f32)>,
    /// The two colours of each part.
    pub linear_rgb: Vec<[Vector; 2]>,
    /// Axis of each part's mesh that comes first in its pattern: the one that a grain runs along.
    pub grain: Vec<usize>,
}

/// Neighbouring triangles of a part, for shading.
#[derive(Clone, Copy)]
pub struct Sheet {
    pub part: u32,
    pub bend: Bend,
}

impl Prepared {
    pub fn new(scenery: Scenery) -> Prepared {
        let (mut sheets, mut sheet_of, mut first) = (Vec::new(), Vec::new(), Vec::new());
        for (part, number) in scenery.parts.iter().zip(0..) {
            first.push(sheet_of.len());
            let (bends, bend_of) = part.mesh.bends();
            sheet_of.extend(bend_of.iter().map(|bend| (sheets.len() + bend) as u32));
            sheets.extend(bends.iter().map(|bend| Sheet { part: number, bend: *bend }));
        }
        first.push(sheet_of.len());
        let id = |sheet: &Sheet| scenery.parts[sheet.part as usize].id;
        let (points, triangles) = scenery.parts.iter().map(|part| joined(&part.mesh)).unzip();
        Prepared {
            points,
            triangles,
            faces: scenery.parts.iter().map(|part| Faces::of(&part.mesh)).collect(),
            ids: sheets.iter().map(id).collect(),
            sheets,
            sheet_of,
            first,
            bounds: scenery.parts.iter().map(|part| part.mesh.bounds()).collect(),
            linear_rgb: scenery.parts.iter().map(colours).collect(),
            grain: scenery.parts.iter().map(grain).collect(),
            scenery,
        }
    }

    /// Numbers of the sheets of a part's triangles.
    pub fn sheets_of(&self, part: usize) -> &[u32] {
        &self.sheet_of[self.first[part]..self.first[part + 1]]
    }

    /// Returns the id of a sheet in images.
    #[inline(always)]
    pub fn id(&self, sheet: u32) -> u32 {
        // No sheet has the number of nothing.
        self.ids.get(sheet as usize).copied().unwrap_or(0)
    }
}

/// Returns the grain axis; print is upright, whichever axis is longest.
fn grain(part: &Part) -> usize {
    if part.pattern == Pattern::Print { 0 } else { part.mesh.longest_axis() }
}

/// Returns the places of a mesh's corners, each once, and its triangles by their numbers.
fn joined(mesh: &TriangleMesh) -> (Points, Vec<[u32; 3]>) {
    let (mut numbers, mut places_m) = (HashMap::new(), Vec::new());
    let mut number = |corner: u32| {
        let place_m = mesh.vertices[corner as usize].position_m;
        *numbers.entry(place_m.to_array().map(f32::to_bits)).or_insert_with(|| {
            places_m.push(place_m);
            places_m.len() as u32 - 1
        })
    };
    let triangles = mesh.triangles.iter().map(|corners| corners.map(&mut number)).collect();
    (Points::new(&places_m), triangles)
}

/// Returns the two linear colours of a part.
fn colours(part: &Part) -> [Vector; 2] {
    let first = linear(part.rgb);
    [first, part.pattern.second_rgb(first)]
}
