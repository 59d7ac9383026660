//! Normals of a mesh: adjacent triangles of one smooth surface share one linear function for their normals.

use std::collections::HashMap;

use rapier3d::math::{Matrix, Vector};

use crate::render::{TriangleMesh, Vertex};

/// Linear function for the normals of some triangles. The normal at a point p, in the mesh's frame and of any
/// length, is `normal + slope_1_m * p`.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    pub normal: Vector,
    /// `None` for flat triangles.
    pub slope_1_m: Option<Matrix>,
}

/// Tolerance on the directions of corner normals that a bend gives.
const TOLERANCE: f32 = 1e-3;

impl TriangleMesh {
    /// Returns the bends of the mesh, and for each triangle the index of the last bend that fits.
    pub(in crate::render) fn bends(&self) -> (Vec<Bend>, Vec<u32>) {
        let ellipsoid = Bend::of_ellipsoid(self.corners_m());
        let mut bends = Bends::default();
        let mut of_triangles = Vec::with_capacity(self.triangles.len());
        for corners in &self.triangles {
            let corners = corners.map(|corner| self.vertices[corner as usize]);
            let same = bends.find(&corners).unwrap_or_else(|| bends.add(Bend::of(&corners, ellipsoid)));
            of_triangles.push(same);
        }
        (bends.all, of_triangles)
    }
}

/// Bends of a mesh, indexed by their normals: a mesh of a file may have one bend for each triangle.
#[derive(Default)]
struct Bends {
    all: Vec<Bend>,
    /// Indices of flat bends, by the cell of their normal.
    flat: HashMap<[i32; 3], Vec<u32>>,
    /// Indices of curved bends.
    curved: Vec<u32>,
}

/// Side of the cells for normals. A bend that fits a triangle is in the cell of the triangle's normal or in
/// an adjacent one.
const CELL: f32 = 2.0 * TOLERANCE;
/// Tolerance plus a margin for rounding.
const REACH: f32 = 1.01 * TOLERANCE;
/// Maximum number of curved bends that are tried, the latest first. Primitive shapes have fewer.
const MAX_CURVED: usize = 64;

impl Bends {
    /// Returns the last bend that fits a triangle.
    fn find(&self, corners: &[Vertex; 3]) -> Option<u32> {
        let normal = corners[0].normal;
        let [low, high] = [cell(normal - Vector::splat(REACH)), cell(normal + Vector::splat(REACH))];
        let fits = |number: &&u32| self.all[**number as usize].fits(corners);
        let mut found = self.curved.iter().rev().take(MAX_CURVED).find(fits).copied();
        for x in low[0]..=high[0] {
            for y in low[1]..=high[1] {
                for z in low[2]..=high[2] {
                    let beside = self.flat.get(&[x, y, z]).map_or(&[][..], Vec::as_slice);
                    found = found.max(beside.iter().rev().find(fits).copied());
                }
            }
        }
        found
    }

    /// Adds a bend and returns its index.
    fn add(&mut self, bend: Bend) -> u32 {
        let number = self.all.len() as u32;
        match bend.slope_1_m {
            None => self.flat.entry(cell(bend.normal.normalize_or_zero())).or_default().push(number),
            Some(_) => self.curved.push(number),
        }
        self.all.push(bend);
        number
    }
}

fn cell(normal: Vector) -> [i32; 3] {
    (normal / CELL).floor().to_array().map(|coordinate| coordinate as i32)
}

impl Bend {
    /// Returns the bend of the ellipsoid in a box: the gradient of (x / r_x)^2 + (y / r_y)^2 + (z /
    /// r_z)^2 about the middle.
    fn of_ellipsoid([low, high]: [Vector; 2]) -> Bend {
        let (middle, radii_m) = ((low + high) * 0.5, ((high - low) * 0.5).max(Vector::splat(f32::EPSILON)));
        let slope_1_m = Matrix::from_diagonal(radii_m.min_element() / (radii_m * radii_m));
        Bend { normal: -(slope_1_m * middle), slope_1_m: Some(slope_1_m) }
    }

    /// Returns the first of these bends that fits: a plane; a surface whose normals are linear in each
    /// coordinate alone, such as a sphere or a cylinder along an axis; the whole mesh's ellipsoid. If none
    /// fits, it returns the bend that interpolates the corners.
    fn of(corners: &[Vertex; 3], ellipsoid: Bend) -> Bend {
        let [a, b, c] = corners;
        let flat = Bend { normal: a.normal, slope_1_m: None };
        let (mut turned, mut across_m2) = (Vector::ZERO, Vector::ZERO);
        for (p, q) in [(a, b), (b, c), (c, a)] {
            let across_m = q.position_m - p.position_m;
            turned += (q.normal - p.normal) * across_m;
            across_m2 += across_m * across_m;
        }
        let slope_1_m = Matrix::from_diagonal(turned / across_m2.max(Vector::splat(f32::MIN_POSITIVE)));
        let round = Bend { normal: a.normal - slope_1_m * a.position_m, slope_1_m: Some(slope_1_m) };
        let known = [flat, round, ellipsoid].into_iter().find(|bend| bend.fits(corners));
        known.unwrap_or_else(|| Bend::between(corners))
    }

    fn fits(&self, corners: &[Vertex; 3]) -> bool {
        corners.iter().all(|corner| {
            let bent = self.slope_1_m.map_or(Vector::ZERO, |slope_1_m| slope_1_m * corner.position_m);
            ((self.normal + bent).normalize_or_zero() - corner.normal).length() < TOLERANCE
        })
    }

    /// Returns the bend that interpolates the corners. A point p of triangle a, b, c with face f = ab x
    /// ac has the weights
    ///   w_b = (ac x f) . ap / |f|^2,   w_c = (f x ab) . ap / |f|^2
    /// and the normal n_a + w_b (n_b - n_a) + w_c (n_c - n_a).
    fn between([a, b, c]: &[Vertex; 3]) -> Bend {
        let (ab, ac) = (b.position_m - a.position_m, c.position_m - a.position_m);
        let face = ab.cross(ac);
        let outer =
            |column: Vector, row: Vector| Matrix::from_cols(column * row.x, column * row.y, column * row.z);
        let scale = 1.0 / face.length_squared();
        let slope_1_m = outer(b.normal - a.normal, ac.cross(face) * scale)
            + outer(c.normal - a.normal, face.cross(ab) * scale);
        Bend { normal: a.normal - slope_1_m * a.position_m, slope_1_m: Some(slope_1_m) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::Primitive;

    /// Returns the result of [`TriangleMesh::bends`] by a search over all earlier bends for each triangle.
    fn one_by_one(mesh: &TriangleMesh) -> Vec<u32> {
        let ellipsoid = Bend::of_ellipsoid(mesh.corners_m());
        let mut bends: Vec<Bend> = Vec::new();
        let find = |corners: &[u32; 3]| {
            let corners = corners.map(|corner| mesh.vertices[corner as usize]);
            let same = bends.iter().rposition(|bend| bend.fits(&corners));
            same.unwrap_or_else(|| {
                bends.push(Bend::of(&corners, ellipsoid));
                bends.len() - 1
            }) as u32
        };
        mesh.triangles.iter().map(find).collect()
    }

    #[test]
    fn bends_are_those_of_a_search_through_all() {
        let hull = |count: u32| Primitive::Convex {
            vertices_m: (0..count)
                .map(|i| {
                    let (polar, round) = (i as f32 / count as f32 * 3.0, i as f32 * 2.4);
                    Vector::new(polar.sin() * round.cos(), polar.sin() * round.sin(), polar.cos())
                })
                .collect(),
        };
        for shape in [
            Primitive::Sphere { radius_m: 0.1 },
            Primitive::Capsule { radius_m: 0.1, half_length_m: 0.3 },
            Primitive::Cylinder { radius_m: 0.1, half_length_m: 0.3 },
            Primitive::Box { half_extents_m: Vector::new(0.1, 0.2, 0.3) },
            Primitive::Ellipsoid { radii_m: Vector::new(0.1, 0.2, 0.3) },
            hull(40),
            hull(3000),
        ] {
            let mesh = TriangleMesh::of(&shape);
            let (bends, of_triangles) = mesh.bends();
            assert!(of_triangles == one_by_one(&mesh), "{} triangles", mesh.triangles.len());
            assert_eq!(of_triangles.iter().max().map(|most| *most as usize + 1), Some(bends.len()));
        }
    }
}
