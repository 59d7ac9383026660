//! Triangles that nobody ever sees: those inside of another part of the same body, as most caps of capsules at a joint are.

use rapier3d::math::Vector;

use crate::render::Part;

/// What lies less deep stays: rounding may bring it out.
const DEPTH_M: f32 = 1e-4;
/// Corners of a convex mesh may lie so far in front of its faces.
const ROUNDING_M: f32 = 1e-5;

/// A convex part, in its carrier's frame.
struct Hull {
    part: usize,
    /// Normals of its faces, outwards, and how far along them the faces lie.
    planes_m: Vec<(Vector, f32)>,
    centre_m: Vector,
    radius_m: f32,
}

/// Takes triangles that lie inside of another part of their carrier out of the parts' meshes, and parts that have no other.
pub fn take_out(parts: &mut Vec<Part>) {
    let hulls: Vec<Hull> = (0..).zip(&**parts).filter_map(|(number, part)| Hull::of(number, part)).collect();
    for number in 0..parts.len() {
        let (corners_m, centre_m, radius_m) = placed(&parts[number]);
        let reaches = |hull: &Hull| (hull.centre_m - centre_m).length() < hull.radius_m + radius_m;
        let around = |hull: &&Hull| {
            hull.part != number && parts[hull.part].carrier == parts[number].carrier && reaches(hull)
        };
        let around: Vec<&Hull> = hulls.iter().filter(around).collect();
        let hidden = |hull: &&Hull, triangle: &[u32; 3]| {
            triangle.iter().all(|corner| hull.is_deeper(corners_m[*corner as usize], DEPTH_M))
        };
        let mesh = &mut parts[number].mesh;
        mesh.triangles.retain(|triangle| !around.iter().any(|hull| hidden(hull, triangle)));
    }
    parts.retain(|part| !part.mesh.triangles.is_empty());
}

/// Corners of a part, and centre and radius of a sphere around it, in its carrier's frame.
fn placed(part: &Part) -> (Vec<Vector>, Vector, f32) {
    let (centre_m, radius_m) = part.mesh.bounds();
    let corners = part.mesh.vertices.iter();
    let corners_m = corners.map(|corner| part.carrier_from_mesh * corner.position_m).collect();
    (corners_m, part.carrier_from_mesh * centre_m, radius_m)
}

impl Hull {
    /// `None` where a part is not convex, or has no inside.
    fn of(number: usize, part: &Part) -> Option<Hull> {
        let (corners_m, centre_m, radius_m) = placed(part);
        let plane = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|corner| corners_m[corner as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            (normal, normal.dot(a))
        };
        let planes_m = part.mesh.triangles.iter().map(plane).collect();
        let hull = Hull { part: number, planes_m, centre_m, radius_m };
        let is_convex = corners_m.iter().all(|corner_m| hull.is_deeper(*corner_m, -ROUNDING_M));
        (is_convex && hull.is_deeper(centre_m, DEPTH_M)).then_some(hull)
    }

    fn is_deeper(&self, point_m: Vector, depth_m: f32) -> bool {
        self.planes_m.iter().all(|(normal, along_m)| normal.dot(point_m) < along_m - depth_m)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::{Carrier, Pattern, TriangleMesh};
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
