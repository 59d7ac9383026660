//! A scenery with what drawing wants to know of it and what never changes.

use rapier3d::math::{Matrix, Vector};

use super::light::linear;
use super::{Mesh, Part, Scenery};

/// Marks a sample at which nothing is.
pub(super) const NOTHING: u32 = u32::MAX;

pub(super) struct Prepared {
    pub scenery: Scenery,
    /// Number of the first triangle of each part: triangles are counted part by part.
    pub first: Vec<u32>,
    /// Of each triangle.
    pub faces: Vec<Face>,
    /// What a picture's ids show for each triangle.
    ids: Vec<u32>,
    /// Centre and radius of a sphere around each part, in its mesh's frame.
    pub bounds: Vec<(Vector, f32)>,
    /// The two colours of each part.
    pub linear_rgb: Vec<[Vector; 2]>,
    /// Of each part, which axis of its mesh the grain runs along.
    pub grain: Vec<usize>,
}

/// A triangle as shading wants it, in its mesh's frame.
#[derive(Clone, Copy)]
pub(super) struct Face {
    pub part: u32,
    pub corner_m: Vector,
    /// At the corner.
    pub normal: Vector,
    /// How the normal changes with the point, per metre; `None` where the triangle is flat.
    pub bend_1_m: Option<Matrix>,
}

impl Prepared {
    pub(super) fn new(scenery: Scenery) -> Prepared {
        let (mut first, mut faces, mut ids) = (Vec::new(), Vec::new(), Vec::new());
        for (number, part) in scenery.parts.iter().enumerate() {
            first.push(faces.len() as u32);
            let triangles = part.mesh.triangles.iter();
            faces.extend(triangles.map(|corners| Face::new(number as u32, &part.mesh, *corners)));
            ids.resize(faces.len(), part.id);
        }
        Prepared {
            first,
            faces,
            ids,
            bounds: scenery.parts.iter().map(|part| part.mesh.bounds()).collect(),
            linear_rgb: scenery.parts.iter().map(colours).collect(),
            grain: scenery.parts.iter().map(|part| part.mesh.longest_axis()).collect(),
            scenery,
        }
    }

    /// What a picture's ids show where it shows a triangle.
    pub(super) fn id(&self, triangle: u32) -> u32 {
        match triangle {
            NOTHING => 0,
            _ => self.ids[triangle as usize],
        }
    }
}

/// Linear, of a part.
fn colours(part: &Part) -> [Vector; 2] {
    let first = linear(part.rgb);
    [first, part.pattern.second_rgb(first)]
}

impl Face {
    /// A point p of triangle a, b, c with face f = ab x ac has the weights
    ///   w_b = (ac x f) . ap / |f|^2,   w_c = (f x ab) . ap / |f|^2
    /// and the normal n_a + w_b (n_b - n_a) + w_c (n_c - n_a).
    fn new(part: u32, mesh: &Mesh, corners: [u32; 3]) -> Face {
        let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
        let (ab, ac) = (b.position_m - a.position_m, c.position_m - a.position_m);
        let face = ab.cross(ac);
        let outer =
            |column: Vector, row: Vector| Matrix::from_cols(column * row.x, column * row.y, column * row.z);
        let scale = 1.0 / face.length_squared();
        let bend_1_m = outer(b.normal - a.normal, ac.cross(face) * scale)
            + outer(c.normal - a.normal, face.cross(ab) * scale);
        let flat = a.normal == b.normal && a.normal == c.normal;
        Face { part, corner_m: a.position_m, normal: a.normal, bend_1_m: (!flat).then_some(bend_1_m) }
    }
}
