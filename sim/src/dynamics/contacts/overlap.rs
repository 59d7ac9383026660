//! Corrections of Parry's contact points for overlapping shapes, where its search fails.
//!
//! For overlapping shapes Parry searches for the depth by growing a polytope within their Minkowski
//! difference (EPA), in single precision and from the end of its search for a distance. Occasionally the
//! search ends at a facet far inside, most often for a hull of many faces or a shape as large as a
//! floor. A foot was reported 2.7 m deep in a floor that it touched, along a normal of neither shape.
//! Along a unit vector n, from a to b, two shapes overlap by
//!   o(n) = max over a of n . x - min over b of n . x,
//! and the depth is the least of that over all n. So a normal is wrong if its o clearly exceeds that of
//! a face or of the last step's normal.

use rapier3d::math::{Pose, Vector};
use rapier3d::parry::query::{ContactManifold, TrackedContact};
use rapier3d::parry::shape::{PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, TypedShape};

/// Overlap along the normal below which the result is always close to the depth.
const DEEP_M: f32 = 0.005;
/// Difference in overlap that a replacement normal must win by.
const CLEARLY_M: f32 = 0.001;

/// Two convex shapes, the second in the frame of the first.
pub struct Overlap<'a> {
    shapes: [&'a dyn Shape; 2],
    /// Both shapes without their rounding, and the radii of the rounding.
    cores: [&'a dyn PolygonalFeatureMap; 2],
    radii_m: [f32; 2],
    a_from_b: &'a Pose,
}

impl<'a> Overlap<'a> {
    /// Returns the overlap of shapes for which Parry searches. Returns `None` for balls, two boxes and
    /// two capsules, whose depth Parry computes by formula.
    pub fn of(shapes: [&'a dyn Shape; 2], a_from_b: &'a Pose) -> Option<Overlap<'a>> {
        let [(a, radius_a_m), (b, radius_b_m)] =
            [shapes[0].as_polygonal_feature_map()?, shapes[1].as_polygonal_feature_map()?];
        let [is_boxes, is_capsules] = [
            shapes.iter().all(|shape| shape.as_cuboid().is_some()),
            shapes.iter().all(|shape| shape.as_capsule().is_some()),
        ];
        (!is_boxes && !is_capsules).then_some(Overlap {
            shapes,
            cores: [a, b],
            radii_m: [radius_a_m, radius_b_m],
            a_from_b,
        })
    }

    /// Replaces points along a normal that cannot be right. It also restores points that Parry has lost
    /// although those of the last step, in `before`, were deep.
    pub fn mend(&self, before: Option<&ContactManifold<(), ()>>, manifold: &mut ContactManifold<(), ()>) {
        let overlaps = |manifold: &ContactManifold<(), ()>, by_m: f32| {
            manifold.points.iter().any(|point| point.dist < -by_m)
        };
        let is_lost = manifold.points.is_empty() && before.is_some_and(|before| overlaps(before, DEEP_M));
        if !is_lost && !overlaps(manifold, 0.0) {
            return;
        }
        let found_m = if is_lost { f32::INFINITY } else { self.along(manifold.local_n1).depth_m };
        if found_m < DEEP_M {
            return;
        }
        let last = before.filter(|before| !before.points.is_empty()).map(|before| before.local_n1);
        let less = |best: Along, other: Along| if other.depth_m < best.depth_m { other } else { best };
        let Some(least) = self.normals(last).map(|normal| self.along(normal)).reduce(less) else { return };
        // If the shapes are separated along this normal, its points would be those of a gap.
        if least.depth_m + CLEARLY_M < found_m && !(is_lost && least.depth_m < 0.0) {
            self.touch(&least, manifold);
        }
    }

    /// Returns the normals of all faces, and that of the last step.
    fn normals(&self, last: Option<Vector>) -> impl Iterator<Item = Vector> {
        let of_a = face_normals(self.shapes[0]);
        let of_b = face_normals(self.shapes[1]).map(|normal| -(self.a_from_b.rotation * normal));
        of_a.chain(of_b).chain(last)
    }

    fn along(&self, normal: Vector) -> Along {
        let on_a_m = self.cores[0].local_support_point(normal);
        let on_b_m = self.cores[1].support_point(self.a_from_b, -normal);
        let core_depth_m = (on_a_m - on_b_m).dot(normal);
        let depth_m = core_depth_m + self.radii_m[0] + self.radii_m[1];
        Along { normal, on_a_m, on_b_m, core_depth_m, depth_m }
    }

    /// Replaces the manifold by the points along this normal, constructed as Parry does.
    fn touch(&self, along: &Along, manifold: &mut ContactManifold<(), ()>) {
        let Along { normal, on_a_m, on_b_m, core_depth_m, .. } = *along;
        let b_from_a = self.a_from_b.inverse();
        let normal_in_b = b_from_a.rotation * -normal;
        let [mut of_a, mut of_b] = [PolygonalFeature::default(), PolygonalFeature::default()];
        self.cores[0].local_support_feature_toward(normal, on_a_m, &mut of_a);
        self.cores[1].local_support_feature_toward(normal_in_b, b_from_a * on_b_m, &mut of_b);
        manifold.clear();
        PolygonalFeature::contacts(
            self.a_from_b,
            &b_from_a,
            normal,
            normal_in_b,
            &of_a,
            &of_b,
            manifold,
            false,
        );
        manifold.points.push(TrackedContact::new(
            on_b_m + normal * core_depth_m,
            b_from_a * on_b_m,
            PackedFeatureId::UNKNOWN,
            PackedFeatureId::UNKNOWN,
            -core_depth_m,
        ));
        for point in &mut manifold.points {
            point.local_p1 += normal * self.radii_m[0];
            point.local_p2 += normal_in_b * self.radii_m[1];
            point.dist -= self.radii_m[0] + self.radii_m[1];
        }
        (manifold.local_n1, manifold.local_n2) = (normal, normal_in_b);
    }
}

/// Overlap of two shapes along a normal: the outermost points of both cores, in the frame of the first.
struct Along {
    normal: Vector,
    on_a_m: Vector,
    on_b_m: Vector,
    core_depth_m: f32,
    depth_m: f32,
}

/// Returns the outward normals of a shape's faces, in its frame; for a round shape those of its ends.
fn face_normals(shape: &dyn Shape) -> impl Iterator<Item = Vector> {
    let axes: &[Vector] = match shape.as_typed_shape() {
        TypedShape::Cuboid(_) | TypedShape::RoundCuboid(_) => &[Vector::X, Vector::Y, Vector::Z],
        TypedShape::Cylinder(_) | TypedShape::RoundCylinder(_) => &[Vector::Y],
        _ => &[],
    };
    let hull = shape.as_convex_polyhedron().map_or(&[][..], |hull| hull.faces());
    axes.iter().flat_map(|axis| [*axis, -*axis]).chain(hull.iter().map(|face| face.normal))
}
