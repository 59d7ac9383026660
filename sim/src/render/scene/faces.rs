//! Back-face test of a mesh's triangles, by their planes and without their corners.

use crate::render::TriangleMesh;
use crate::render::shading::lanes::{LANES, Lanes, lanes};

/// Planes of a mesh's triangles, in the mesh's frame and in whole blocks: unit normals, and the planes'
/// offsets along these normals.
pub struct Faces {
    planes_m: Vec<[Lanes; 4]>,
    count: usize,
}

/// Tolerance below which a back face counts as visible: rounding may draw it.
const GRAZING: f32 = 1e-4;

impl Faces {
    pub fn of(mesh: &TriangleMesh) -> Faces {
        let mut planes_m = vec![[[0.0; LANES]; 4]; mesh.triangles.len().div_ceil(LANES)];
        for (number, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize].position_m.as_dvec3());
            let normal = (b - a).cross(c - a).normalize_or_zero();
            for (lanes, value) in
                planes_m[number / LANES].iter_mut().zip([normal.x, normal.y, normal.z, normal.dot(a)])
            {
                lanes[number % LANES] = value as f32;
            }
        }
        Faces { planes_m, count: mesh.triangles.len() }
    }

    /// Writes the indices of the triangles that may be visible, in their order. The viewer is at a point (x,
    /// y, z, 1) of the mesh's frame, or infinitely far in a direction (x, y, z, 0).
    #[inline(always)]
    pub fn put_front(&self, front: &mut Vec<u32>, [x, y, z, w]: [f32; 4]) {
        front.resize(self.planes_m.len() * LANES, 0);
        let mut found = 0;
        for ([a, b, c, d], block) in self.planes_m.iter().zip(0..) {
            let side: Lanes = lanes(|i| a[i] * x + b[i] * y + c[i] * z - d[i] * w);
            for (i, side) in (0..).zip(side) {
                front[found] = block * LANES as u32 + i;
                found += usize::from(side > -GRAZING);
            }
        }
        front.truncate(found);
        while front.last().is_some_and(|last| *last as usize >= self.count) {
            front.pop();
        }
    }
}
