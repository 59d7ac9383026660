//! Meshes with derived geometry, which is computed once and shared by all scenes that contain the mesh.

use std::collections::HashMap;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use rapier3d::math::Vector;

use super::faces::Faces;
use super::patches::MeshPatch;
use crate::render::TriangleMesh;
use crate::render::shading::lanes::Points;

/// Triangle mesh that is cloned by reference.
#[derive(Clone, Debug)]
pub struct SharedMesh(Arc<KeptMesh>);

#[derive(Debug)]
struct KeptMesh {
    mesh: TriangleMesh,
    geometry: OnceLock<MeshGeometry>,
}

/// Geometry of a mesh that does not depend on pose, colour or light.
pub struct MeshGeometry {
    /// Corners of the triangles, without duplicate positions. Meshes with flat faces repeat a corner for each
    /// of its triangles.
    pub points: Points,
    /// Triangles, as indices of their corners in `points`.
    pub triangles: Vec<[u32; 3]>,
    /// Planes of the triangles.
    pub faces: Faces,
    pub patches: Vec<MeshPatch>,
    /// Index of each triangle's patch.
    pub patch_of: Vec<u32>,
    /// Centre and radius of a sphere around the mesh.
    pub bounds: (Vector, f32),
    /// Index of the longest axis of the mesh.
    pub longest_axis: usize,
}

impl SharedMesh {
    /// Returns the derived geometry of the mesh. The first call computes it.
    pub(in crate::render) fn geometry(&self) -> &MeshGeometry {
        self.0.geometry.get_or_init(|| MeshGeometry::of(&self.0.mesh))
    }
}

impl From<TriangleMesh> for SharedMesh {
    fn from(mesh: TriangleMesh) -> SharedMesh {
        SharedMesh(Arc::new(KeptMesh { mesh, geometry: OnceLock::new() }))
    }
}

impl Deref for SharedMesh {
    type Target = TriangleMesh;

    fn deref(&self) -> &TriangleMesh {
        &self.0.mesh
    }
}

impl PartialEq for SharedMesh {
    fn eq(&self, other: &SharedMesh) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0.mesh == other.0.mesh
    }
}

impl MeshGeometry {
    fn of(mesh: &TriangleMesh) -> MeshGeometry {
        let (patches, patch_of) = mesh.patches();
        let (points, triangles) = joined(mesh);
        MeshGeometry {
            points,
            triangles,
            faces: Faces::of(mesh),
            patches,
            patch_of,
            bounds: mesh.bounds(),
            longest_axis: mesh.longest_axis(),
        }
    }
}

impl std::fmt::Debug for MeshGeometry {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "MeshGeometry of {} triangles", self.triangles.len())
    }
}

/// Joins the corners of a mesh that have the same position. Returns the positions, and the triangles as
/// indices of them.
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
