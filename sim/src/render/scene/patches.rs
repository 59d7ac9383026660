//! Patches of a mesh: adjacent triangles that share one formula for normals and one for texture coordinates.

use rapier3d::math::Vector;

use super::bend::Bend;
use crate::render::shading::lanes::Affine;
use crate::render::{TriangleMesh, Vertex};

/// Patch of a mesh, in the mesh's frame.
#[derive(Clone, Copy, Debug)]
pub struct MeshPatch {
    pub bend: Bend,
    /// `None` without texture coordinates.
    pub uv: Option<UvMap>,
}

/// Texture coordinates at a point: each is a scalar product plus a constant.
#[derive(Clone, Copy, Debug)]
pub struct UvMap(pub [(Vector, f32); 2]);

/// Tolerance on texture coordinates that a map gives.
const UV_TOLERANCE: f32 = 1e-4;
/// Number of the latest patches that are tried for a triangle.
const TRIED: usize = 8;

impl TriangleMesh {
    /// Returns the patches of the mesh, and for each triangle the index of its patch.
    pub(in crate::render) fn patches(&self) -> (Vec<MeshPatch>, Vec<u32>) {
        let (bends, bend_of) = self.bends();
        if self.vertices.iter().all(|vertex| vertex.uv == [0.0; 2]) {
            return (bends.into_iter().map(|bend| MeshPatch { bend, uv: None }).collect(), bend_of);
        }
        let (mut patches, mut of_bend): (Vec<(u32, UvMap)>, _) = (Vec::new(), Vec::new());
        for (corners, bend) in self.triangles.iter().zip(&bend_of) {
            let corners = corners.map(|corner| self.vertices[corner as usize]);
            let fits = |(other, map): &(u32, UvMap)| other == bend && map.fits(&corners);
            let latest = patches.len().saturating_sub(TRIED);
            let found = patches[latest..].iter().rposition(fits).map(|index| latest + index);
            of_bend.push(found.unwrap_or(patches.len()) as u32);
            if found.is_none() {
                patches.push((*bend, UvMap::between(&corners)));
            }
        }
        let patch = |(bend, map): (u32, UvMap)| MeshPatch { bend: bends[bend as usize], uv: Some(map) };
        (patches.into_iter().map(patch).collect(), of_bend)
    }
}

impl UvMap {
    /// Returns the map that interpolates the corners of a triangle, as [`Bend`] does for normals. For a
    /// triangle without area the map is constant, with the coordinates of the first corner.
    fn between([a, b, c]: &[Vertex; 3]) -> UvMap {
        let (ab, ac) = (b.position_m - a.position_m, c.position_m - a.position_m);
        let face = ab.cross(ac);
        let per_area = face.length_squared().recip();
        UvMap(std::array::from_fn(|axis| {
            let (by_b, by_c) = (b.uv[axis] - a.uv[axis], c.uv[axis] - a.uv[axis]);
            let along = (ac.cross(face) * by_b + face.cross(ab) * by_c) * per_area;
            let along = if along.is_finite() { along } else { Vector::ZERO };
            (along, a.uv[axis] - along.dot(a.position_m))
        }))
    }

    /// Returns the map with a third coordinate that is 0.
    pub fn affine(&self) -> Affine {
        let [u, v] = self.0;
        Affine([u, v, (Vector::ZERO, 0.0)])
    }

    fn fits(&self, corners: &[Vertex; 3]) -> bool {
        corners.iter().all(|corner| {
            self.0.iter().zip(corner.uv).all(|((along, constant), uv)| {
                (along.dot(corner.position_m) + constant - uv).abs() < UV_TOLERANCE
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns a square of two triangles at z = 0, whose corners have these texture coordinates.
    fn square(uvs: [[f32; 2]; 6]) -> TriangleMesh {
        let corners = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
        let vertices = corners.iter().zip(uvs).map(|([x, y], uv)| Vertex {
            position_m: Vector::new(*x, *y, 0.0),
            normal: Vector::Z,
            uv,
        });
        TriangleMesh { vertices: vertices.collect(), triangles: vec![[0, 1, 2], [3, 4, 5]] }
    }

    #[test]
    fn triangles_with_one_map_are_one_patch_and_those_with_two_are_two() {
        let whole = square([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
        let (patches, patch_of) = whole.patches();
        assert_eq!(patch_of, [0, 0]);
        let [u, v] = patches[0].uv.expect("a map").0.map(|(along, constant)| (along.to_array(), constant));
        assert_eq!((u, v), (([0.5, 0.0, 0.0], 0.0), ([0.0, -0.5, 0.0], 1.0)));

        let torn = square([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 0.5]]);
        assert_eq!(torn.patches().1, [0, 1]);
        let plain = torn.without_uvs().patches();
        assert_eq!((plain.0.len(), plain.1), (1, vec![0, 0]));
        assert!(plain.0[0].uv.is_none());
    }
}
