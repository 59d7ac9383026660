//! Orientation of a mesh's surface: triangles that continue each other smoothly share one bend.

use rapier3d::math::{Matrix, Vector};

use crate::render::{TriangleMesh, Vertex};

/// The normal at a point p of some triangles, in their mesh's frame and of any length:
/// `normal + slope_1_m * p`.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    pub normal: Vector,
    /// `None` if they are flat.
    pub slope_1_m: Option<Matrix>,
}

/// Tolerance on the directions of corner normals that a bend gives.
const TOLERANCE: f32 = 1e-3;

impl TriangleMesh {
    /// Returns the bends of the mesh, and the indices of each triangle's own.
    pub(in crate::render) fn bends(&self) -> (Vec<Bend>, Vec<usize>) {
        let ellipsoid = Bend::of_ellipsoid(self.corners_m());
        let mut bends: Vec<Bend> = Vec::new();
        let mut of_triangles = Vec::with_capacity(self.triangles.len());
        for corners in &self.triangles {
            let corners = corners.map(|corner| self.vertices[corner as usize]);
            let same = bends.iter().rposition(|bend| bend.fits(&corners)).unwrap_or_else(|| {
                bends.push(Bend::of(&corners, ellipsoid));
                bends.len() - 1
            });
            of_triangles.push(same);
        }
        (bends, of_triangles)
    }
}

impl Bend {
    /// Returns the bend of the ellipsoid in a box: the gradient of (x / r_x)^2 + (y / r_y)^2 + (z /
    /// r_z)^2 about the middle.
    fn of_ellipsoid([low, high]: [Vector; 2]) -> Bend {
        let (middle, radii_m) = ((low + high) * 0.5, ((high - low) * 0.5).max(Vector::splat(f32::EPSILON)));
        let slope_1_m = Matrix::from_diagonal(radii_m.min_element() / (radii_m * radii_m));
        Bend { normal: -(slope_1_m * middle), slope_1_m: Some(slope_1_m) }
    }

    /// Returns the first bend that fits of these: a plane; a surface whose normals are linear in each
    /// coordinate alone, such as spheres and cylinders along an axis; the whole mesh's ellipsoid.
    /// Otherwise it returns the bend of these corners alone.
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
