//! Removal of triangles that are never visible: those inside of another part of the same body, such as
//! most caps of capsules at a joint.

use rapier3d::math::Vector;

use crate::render::{Carrier, Part};

/// Minimum depth of a hidden triangle; less deep ones stay, since rounding may bring them out.
const DEPTH_M: f32 = 1e-4;
/// Maximum distance of a convex mesh's corners in front of its faces.
const ROUNDING_M: f32 = 1e-5;

/// A part in its carrier's frame.
struct Placed {
    corners_m: Vec<Vector>,
    /// Of a sphere around it.
    centre_m: Vector,
    radius_m: f32,
    /// Normals of its faces, outwards, and how far along them the faces lie, if it is convex.
    hull_m: Option<Vec<(Vector, f32)>>,
}

/// Takes triangles that lie inside of another part of their carrier out of the parts' meshes, and parts that have no other.
pub fn take_out(parts: &mut Vec<Part>) {
    let placed: Vec<Placed> = parts.iter().map(Placed::of).collect();
    let carriers: Vec<Carrier> = parts.iter().map(|part| part.carrier).collect();
    for (number, part) in parts.iter_mut().enumerate() {
        let own = &placed[number];
        let others = placed.iter().enumerate().filter(|(other, _)| *other != number);
        let around = others.filter(|(other, placed)| carriers[*other] == part.carrier && placed.reaches(own));
        let hulls: Vec<_> = around.filter_map(|(_, placed)| placed.hull_m.as_deref()).collect();
        let hides = |hull: &[(Vector, f32)], triangle: &[u32; 3]| {
            triangle.iter().all(|corner| is_deeper(hull, own.corners_m[*corner as usize], DEPTH_M))
        };
        part.mesh.triangles.retain(|triangle| !hulls.iter().any(|hull| hides(hull, triangle)));
    }
    parts.retain(|part| !part.mesh.triangles.is_empty());
}

impl Placed {
    fn of(part: &Part) -> Placed {
        let (centre_m, radius_m) = part.mesh.bounds();
        let centre_m = part.carrier_from_mesh * centre_m;
        let corners = part.mesh.vertices.iter();
        let corners_m: Vec<Vector> =
            corners.map(|corner| part.carrier_from_mesh * corner.position_m).collect();
        let face = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| corners_m[corner as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            (normal, normal.dot(a))
        };
        let faces_m: Vec<_> = part.mesh.triangles.iter().map(face).collect();
        let is_convex = corners_m.iter().all(|corner_m| is_deeper(&faces_m, *corner_m, -ROUNDING_M));
        // What is flat has no inside.
        let hull_m = (is_convex && is_deeper(&faces_m, centre_m, DEPTH_M)).then_some(faces_m);
        Placed { corners_m, centre_m, radius_m, hull_m }
    }

    fn reaches(&self, other: &Placed) -> bool {
        (self.centre_m - other.centre_m).length() < self.radius_m + other.radius_m
    }
}

/// Returns true if a point is at least this deep behind all of some faces.
fn is_deeper(faces_m: &[(Vector, f32)], point_m: Vector, depth_m: f32) -> bool {
    faces_m.iter().all(|(normal, along_m)| normal.dot(point_m) < along_m - depth_m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Pattern, TriangleMesh};
    use rapier3d::math::Pose;

    fn part(mesh: TriangleMesh, x_m: f32, carrier: Carrier) -> Part {
        let carrier_from_mesh = Pose::from_translation(Vector::new(x_m, 0.0, 0.0));
        let (rgb, pattern) = ([0.5; 3], Pattern::Plain);
        Part { mesh, carrier, carrier_from_mesh, rgb, pattern, id: 1, casts_shadow: true }
    }

    fn left<const N: usize>(parts: [Part; N]) -> Vec<usize> {
        let mut parts = parts.to_vec();
        take_out(&mut parts);
        parts.iter().map(|part| part.mesh.triangles.len()).collect()
    }

    #[test]
    fn what_is_inside_of_another_part_of_the_body_goes_and_all_else_stays() {
        let cuboid = || TriangleMesh::cuboid(Vector::splat(0.1));
        let sphere = || TriangleMesh::sphere(0.05);
        let whole = sphere().triangles.len();
        let object = Carrier::Object(0);
        let beside = |x_m: f32, carrier| left([part(cuboid(), 0.0, object), part(sphere(), x_m, carrier)]);
        assert_eq!(beside(0.0, object), [12]);
        assert_eq!(beside(0.0, Carrier::Object(1)), [12, whole], "another body may move away");
        assert_eq!(beside(0.2, object), [12, whole]);
        let shows = |corner: &u32| sphere().vertices[*corner as usize].position_m.x > -DEPTH_M;
        let shown = sphere().triangles.iter().filter(|triangle| triangle.iter().any(shows)).count();
        assert!((whole / 2..whole).contains(&shown));
        assert_eq!(beside(0.1, object), [12, shown]);
    }

    #[test]
    fn what_is_not_convex_or_lies_in_the_same_place_hides_nothing() {
        let object = Carrier::Object(0);
        let cuboid = || TriangleMesh::cuboid(Vector::splat(0.1));
        assert_eq!(left([part(cuboid(), 0.0, object), part(cuboid(), 0.0, object)]), [12, 12]);
        let mut corner = cuboid();
        let arm = TriangleMesh::cuboid(Vector::new(0.5, 0.02, 0.02));
        corner.triangles.extend(arm.triangles.iter().map(|triangle| triangle.map(|i| i + 24)));
        corner.vertices.extend(arm.vertices);
        let sphere = TriangleMesh::sphere(0.05);
        let whole = sphere.triangles.len();
        assert_eq!(left([part(corner, 0.0, object), part(sphere, 0.0, object)]), [24, whole]);
        let plane = TriangleMesh::plane([1.0, 1.0]);
        assert_eq!(left([part(plane, 0.0, object), part(cuboid(), 0.0, object)]), [2, 12]);
    }
}
