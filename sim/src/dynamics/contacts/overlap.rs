//! Corrections of Parry's contact points for overlapping shapes, where its search fails.
//!
//! For overlapping shapes Parry searches for the depth by growing a polytope within their Minkowski
//! difference (EPA), in single precision and from the end of its search for a distance. Occasionally the
//! search ends at a facet far inside, most often for a hull of many faces or a shape as large as a
//! floor. A foot was reported 2.7 m deep in a floor that it touched, along a normal of neither shape.
//! Along a unit vector n, from a to b, two shapes overlap by
//!   o(n) = max over a of n . x - min over b of n . x,
//! and the depth is the minimum of that over all n. So a normal is wrong if its o clearly exceeds the o of a
//! face's normal or of the last step's normal.

use rapier3d::math::{Pose, Vector};
use rapier3d::parry::query::{ContactManifold, TrackedContact};
use rapier3d::parry::shape::{PackedFeatureId, PolygonalFeature, PolygonalFeatureMap, Shape, TypedShape};

/// Overlap along the normal below which the result is always close to the depth.
const DEEP_M: f32 = 0.005;
/// Number of outermost points that are kept. A normal is skipped if its overlap at these points exceeds the
/// least overlap by `CERTAINLY_M`, which is far above rounding.
const REMEMBERED: usize = 16;
const CERTAINLY_M: f32 = 0.0001;
/// Minimum difference in overlap at which another normal replaces the present one.
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
    /// Returns the overlap of shapes for which Parry searches. Returns `None` for balls, two boxes and two
    /// capsules, whose depth Parry computes in closed form.
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

    /// Replaces points along a normal that cannot be right. Also restores points that Parry has lost although
    /// the points of the last step, in `before`, were deep.
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
        let Some(least) = self.least(self.normals(last)) else { return };
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

    /// Returns the least overlap along the normals; among equal overlaps, the first. The search for outermost
    /// points is slow for hulls with many corners. A normal is skipped if points that were found for other
    /// normals already overlap by more.
    fn least(&self, normals: impl Iterator<Item = Vector>) -> Option<Along> {
        let mut known: [[Vector; 2]; REMEMBERED] = Default::default();
        let mut found = 0;
        let mut least: Option<Along> = None;
        for normal in normals {
            if let Some(least) = &least {
                let known = &known[..found.min(REMEMBERED)];
                let on_a = known.iter().map(|[on_a_m, _]| on_a_m.dot(normal)).fold(f32::MIN, f32::max);
                let on_b = known.iter().map(|[_, on_b_m]| on_b_m.dot(normal)).fold(f32::MAX, f32::min);
                if on_a - on_b + self.radii_m[0] + self.radii_m[1] > least.depth_m + CERTAINLY_M {
                    continue;
                }
            }
            let along = self.along(normal);
            known[found % REMEMBERED] = [along.on_a_m, along.on_b_m];
            found += 1;
            if least.as_ref().is_none_or(|least| along.depth_m < least.depth_m) {
                least = Some(along);
            }
        }
        least
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

/// Returns the outward normals of a shape's faces, in the shape's frame. For a round shape, they are those of
/// its ends.
fn face_normals(shape: &dyn Shape) -> impl Iterator<Item = Vector> {
    let axes: &[Vector] = match shape.as_typed_shape() {
        TypedShape::Cuboid(_) | TypedShape::RoundCuboid(_) => &[Vector::X, Vector::Y, Vector::Z],
        TypedShape::Cylinder(_) | TypedShape::RoundCylinder(_) => &[Vector::Y],
        _ => &[],
    };
    let hull = shape.as_convex_polyhedron().map_or(&[][..], |hull| hull.faces());
    axes.iter().flat_map(|axis| [*axis, -*axis]).chain(hull.iter().map(|face| face.normal))
}

#[cfg(test)]
mod tests {
    use rapier3d::math::Rotation;
    use rapier3d::prelude::SharedShape;

    use super::*;
    use crate::dynamics::tests::bench::Random;

    /// Normals that are left out never have the least overlap.
    #[test]
    fn the_least_overlap_is_that_of_a_search_along_all_normals() {
        let mut random = Random(5);
        let mut point = |scale_m: f64| (random.vector() * scale_m).as_vec3();
        for _ in 0..40 {
            let mut hull = |corners: usize| {
                let points: Vec<Vector> = (0..corners).map(|_| point(1.0).normalize() * 0.2).collect();
                SharedShape::convex_hull(&points).expect("points in space")
            };
            let shapes = [hull(200), hull(60)];
            let slab = SharedShape::cuboid(50.0, 50.0, 1.0);
            let turn = Rotation::from_scaled_axis(point(3.0));
            let (beside, above) = (point(0.2), Vector::new(point(40.0).x, point(40.0).y, 1.15));
            for (a, b, at) in [(&shapes[0], &shapes[1], beside), (&slab, &shapes[1], above)] {
                let a_from_b = Pose::from_parts(at, turn);
                let overlap = Overlap::of([&**a, &**b], &a_from_b).expect("shapes that Parry searches");
                let all_m = overlap.normals(None).map(|normal| overlap.along(normal).depth_m);
                let least_m = overlap.least(overlap.normals(None)).expect("faces").depth_m;
                assert_eq!(least_m, all_m.fold(f32::MAX, f32::min));
            }
        }
    }
}
