//! Removal of triangles that are never visible because they are inside another part of the same body, such as
//! most caps of capsules at a joint.

use rapier3d::math::{Pose, Vector};

use crate::render::TriangleMesh;

/// Minimum depth of a hidden triangle. Triangles at smaller depths stay, since rounding may make them
/// visible.
const DEPTH_M: f32 = 1e-4;
/// Maximum distance of a convex mesh's corners in front of its faces.
const ROUNDING_M: f32 = 1e-5;
/// Maximum number of triangles of a mesh that can hide others. The test for convexity takes quadratic time.
const MAX_HULL_TRIANGLES: usize = 1000;

/// Mesh in the frame of its body.
struct Placed {
    corners_m: Vec<Vector>,
    /// Centre and radius of a sphere around the mesh.
    centre_m: Vector,
    radius_m: f32,
    /// Outward normals of its faces, and the faces' offsets along them; `None` unless the mesh is convex.
    hull_m: Option<Vec<(Vector, f32)>>,
}

/// Removes triangles inside another mesh of the body that is not see-through. Each mesh has its pose in the
/// frame of the body.
pub fn take_out(meshes: &mut [(TriangleMesh, Pose)], is_clear: &[bool]) {
    let placed: Vec<Placed> =
        meshes.iter().map(|(mesh, body_from_mesh)| Placed::of(mesh, body_from_mesh)).collect();
    for (number, (mesh, _)) in meshes.iter_mut().enumerate() {
        let own = &placed[number];
        let others = placed.iter().enumerate().filter(|(other, _)| *other != number && !is_clear[*other]);
        let around = others.filter(|(_, placed)| placed.reaches(own));
        let hulls: Vec<_> = around.filter_map(|(_, placed)| placed.hull_m.as_deref()).collect();
        let hides = |hull: &[(Vector, f32)], triangle: &[u32; 3]| {
            triangle.iter().all(|corner| is_deeper(hull, own.corners_m[*corner as usize], DEPTH_M))
        };
        mesh.triangles.retain(|triangle| !hulls.iter().any(|hull| hides(hull, triangle)));
    }
}

impl Placed {
    fn of(mesh: &TriangleMesh, body_from_mesh: &Pose) -> Placed {
        let (centre_m, radius_m) = mesh.bounds();
        let centre_m = *body_from_mesh * centre_m;
        let corners_m: Vec<Vector> =
            mesh.vertices.iter().map(|corner| *body_from_mesh * corner.position_m).collect();
        let hull_m = (mesh.triangles.len() <= MAX_HULL_TRIANGLES)
            .then(|| hull_m(mesh, &corners_m))
            // A flat mesh has no inside.
            .filter(|faces_m| is_deeper(faces_m, centre_m, DEPTH_M))
            .filter(|faces_m| corners_m.iter().all(|corner_m| is_deeper(faces_m, *corner_m, -ROUNDING_M)));
        Placed { corners_m, centre_m, radius_m, hull_m }
    }

    fn reaches(&self, other: &Placed) -> bool {
        (self.centre_m - other.centre_m).length() < self.radius_m + other.radius_m
    }
}

/// Returns the faces of a mesh with these corners: their normals, and their offsets along them.
fn hull_m(mesh: &TriangleMesh, corners_m: &[Vector]) -> Vec<(Vector, f32)> {
    let face = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| corners_m[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        (normal, normal.dot(a))
    };
    mesh.triangles.iter().map(face).collect()
}

/// Returns true if a point is more than `depth_m` behind every face.
fn is_deeper(faces_m: &[(Vector, f32)], point_m: Vector, depth_m: f32) -> bool {
    faces_m.iter().all(|(normal, along_m)| normal.dot(point_m) < along_m - depth_m)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left<const N: usize>(meshes: [(TriangleMesh, f32); N]) -> Vec<usize> {
        let place = |(mesh, x_m)| (mesh, Pose::from_translation(Vector::new(x_m, 0.0, 0.0)));
        let mut meshes = meshes.map(place);
        take_out(&mut meshes, &[false; N]);
        meshes.iter().map(|(mesh, _)| mesh.triangles.len()).collect()
    }

    #[test]
    fn what_is_inside_of_another_part_of_the_body_goes_and_all_else_stays() {
        let cuboid = || TriangleMesh::cuboid(Vector::splat(0.1));
        let sphere = || TriangleMesh::sphere(0.05);
        let whole = sphere().triangles.len();
        let beside = |x_m: f32| left([(cuboid(), 0.0), (sphere(), x_m)]);
        assert_eq!(beside(0.0), [12, 0]);
        assert_eq!(beside(0.2), [12, whole]);
        let shows = |corner: &u32| sphere().vertices[*corner as usize].position_m.x > -DEPTH_M;
        let shown = sphere().triangles.iter().filter(|triangle| triangle.iter().any(shows)).count();
        assert!((whole / 2..whole).contains(&shown));
        assert_eq!(beside(0.1), [12, shown]);
    }

    #[test]
    fn what_is_not_convex_or_lies_in_the_same_place_hides_nothing() {
        let cuboid = || TriangleMesh::cuboid(Vector::splat(0.1));
        assert_eq!(left([(cuboid(), 0.0), (cuboid(), 0.0)]), [12, 12]);
        let mut corner = cuboid();
        let arm = TriangleMesh::cuboid(Vector::new(0.5, 0.02, 0.02));
        corner.triangles.extend(arm.triangles.iter().map(|triangle| triangle.map(|i| i + 24)));
        corner.vertices.extend(arm.vertices);
        let sphere = TriangleMesh::sphere(0.05);
        let whole = sphere.triangles.len();
        assert_eq!(left([(corner, 0.0), (sphere, 0.0)]), [24, whole]);
        let plane = TriangleMesh::plane([1.0, 1.0]);
        assert_eq!(left([(plane, 0.0), (cuboid(), 0.0)]), [2, 12]);
    }
}
