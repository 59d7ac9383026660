//! Which way a mesh's surface faces: triangles that go over into each other share one answer.

use rapier3d::math::{Matrix, Vector};

use crate::render::{TriangleMesh, Vertex};

/// The normal at a point p of some triangles, in their mesh's frame and of any length: `normal + slope_1_m * p`.
#[derive(Clone, Copy, Debug)]
pub struct Bend {
    pub normal: Vector,
    /// `None` where they are flat.
    pub slope_1_m: Option<Matrix>,
}

/// Corners have the normals that a bend gives them, but for this.
const TOLERANCE: f32 = 1e-3;

impl TriangleMesh {
    /// The bends of the mesh, and of each triangle which of them is its.
    pub(in crate::render) fn bends(&self) -> (Vec<Bend>, Vec<usize>) {
        let mut bends: Vec<Bend> = Vec::new();
        let mut of_triangles = Vec::with_capacity(self.triangles.len());
        for corners in &self.triangles {
            let corners = corners.map(|corner| self.vertices[corner as usize]);
            let same = bends.iter().rposition(|bend| bend.fits(&corners)).unwrap_or_else(|| {
                bends.push(Bend::of(&corners));
                bends.len() - 1
            });
            of_triangles.push(same);
        }
        (bends, of_triangles)
    }
}

impl Bend {
    /// The bend of a plane, else of a cylinder along z, else of a sphere, else of these corners alone.
    fn of(corners: &[Vertex; 3]) -> Bend {
        let [a, b, c] = corners;
        let flat = Bend { normal: a.normal, slope_1_m: None };
        // The longest difference says most about the radius.
        let by_length = |(p, q): &(&Vertex, &Vertex)| (q.normal - p.normal).length();
        let (p, q) = [(a, b), (b, c), (c, a)]
            .into_iter()
            .max_by(|one, other| by_length(one).total_cmp(&by_length(other)))
            .expect("there are three");
        let round = |axes: Vector| {
            let (across_m, turned) = ((q.position_m - p.position_m) * axes, (q.normal - p.normal) * axes);
            let slope_1_m = Matrix::from_diagonal(axes * (turned.dot(across_m) / across_m.length_squared()));
            Bend { normal: p.normal - slope_1_m * p.position_m, slope_1_m: Some(slope_1_m) }
        };
        [flat, round(Vector::new(1.0, 1.0, 0.0)), round(Vector::ONE)]
            .into_iter()
            .find(|bend| bend.fits(corners))
            .unwrap_or_else(|| Bend::between(corners))
    }

    fn fits(&self, corners: &[Vertex; 3]) -> bool {
        corners.iter().all(|corner| {
            let bent = self.slope_1_m.map_or(Vector::ZERO, |slope_1_m| slope_1_m * corner.position_m);
            (self.normal + bent - corner.normal).length() < TOLERANCE
        })
    }

    /// A point p of triangle a, b, c with face f = ab x ac has the weights
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
