//! Axis of an upright round object, whose horizontal slices are concentric arcs.

use nalgebra::{Matrix3, Point3, Vector2, Vector3};

/// Height of a slice, and minimum number of points in it.
const SLICE_M: f64 = 0.01;
const MIN_POINTS: usize = 5;
/// Limits for a slice to be an arc: maximum distance of its points from the circle, also as a fraction of the
/// radius; minimum angle of the arc; range of radii.
const OFF_M: f64 = 0.002;
const OFF_PART: f64 = 0.06;
const MIN_ARC_RAD: f64 = 1.2;
const RADII_M: std::ops::Range<f64> = 0.01..0.4;
/// Limits for slices to share an axis: minimum number of them, minimum fraction of all slices, and
/// maximum distance of their centres, also as a fraction of the radius.
const MIN_SLICES: usize = 3;
const MIN_SHARE: f64 = 0.5;
const ABOUT_M: f64 = 0.006;
const ABOUT_PART: f64 = 0.15;

/// A vertical axis in a level frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    pub at_m: Vector2<f64>,
    pub bottom_m: f64,
    pub top_m: f64,
    pub radius_m: f64,
}

/// A circle.
#[derive(Clone, Copy, Debug)]
struct Circle {
    middle_m: Vector2<f64>,
    radius_m: f64,
}

/// Returns the axis of the object whose points are `points_m`, seen from `eye_m`, all in a level frame.
/// `None` if the object is not upright and round.
pub fn axis(points_m: &[Point3<f64>], eye_m: &Point3<f64>) -> Option<Axis> {
    let heights = || points_m.iter().map(|point_m| point_m.z);
    let (bottom_m, top_m) =
        (heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max));
    let count = ((top_m - bottom_m) / SLICE_M).ceil().clamp(1.0, 1000.0) as usize;
    let mut slices = vec![Vec::new(); count];
    for point_m in points_m {
        let slice = ((point_m.z - bottom_m) / SLICE_M) as usize;
        slices[slice.min(count - 1)].push(point_m.coords.xy());
    }
    let told = slices.iter().filter(|slice| slice.len() >= MIN_POINTS);
    let circles: Vec<Option<Circle>> = told.map(|slice| arc(slice, &eye_m.coords.xy())).collect();
    let mut arcs: Vec<Circle> = circles.iter().flatten().copied().collect();
    let enough = |arcs: usize| arcs >= MIN_SLICES && arcs as f64 >= MIN_SHARE * circles.len() as f64;
    if !enough(arcs.len()) {
        return None;
    }
    let middle = |part: &dyn Fn(&Circle) -> f64| {
        let mut parts: Vec<f64> = arcs.iter().map(part).collect();
        parts.sort_by(f64::total_cmp);
        parts[parts.len() / 2]
    };
    let at_m = Vector2::new(middle(&|circle| circle.middle_m.x), middle(&|circle| circle.middle_m.y));
    let radius_m = middle(&|circle| circle.radius_m);
    arcs.retain(|circle| (circle.middle_m - at_m).norm() < ABOUT_M.max(ABOUT_PART * radius_m));
    enough(arcs.len()).then_some(Axis { at_m, bottom_m, top_m, radius_m })
}

/// Returns the circle through points by Kasa's least squares: x^2 + y^2 = 2 a x + 2 b y + c. `None` if
/// they are not an arc that faces the eye.
fn arc(points_m: &[Vector2<f64>], eye_m: &Vector2<f64>) -> Option<Circle> {
    let mean_m = points_m.iter().sum::<Vector2<f64>>() / points_m.len() as f64;
    let (mut normal, mut right) = (Matrix3::zeros(), Vector3::zeros());
    for point_m in points_m {
        let at_m = point_m - mean_m;
        let row = Vector3::new(2.0 * at_m.x, 2.0 * at_m.y, 1.0);
        normal += row * row.transpose();
        right += row * at_m.norm_squared();
    }
    let found = normal.lu().solve(&right)?;
    let radius_m = (found.z + found.x.powi(2) + found.y.powi(2)).max(0.0).sqrt();
    let middle_m = mean_m + found.xy();
    let off_m =
        points_m.iter().map(|point_m| ((point_m - middle_m).norm() - radius_m).abs()).fold(0.0, f64::max);
    let is_round = RADII_M.contains(&radius_m) && off_m < OFF_M.min(OFF_PART * radius_m);
    // An object shows its near side, a hollow its far side.
    let stands_out = (middle_m - eye_m).norm() > (mean_m - eye_m).norm();
    let towards = (eye_m - middle_m).normalize();
    let angles_rad = points_m.iter().map(|point_m| {
        let out = point_m - middle_m;
        towards.perp(&out).atan2(towards.dot(&out))
    });
    let (low, high) = angles_rad
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), angle| (low.min(angle), high.max(angle)));
    (is_round && stands_out && high - low > MIN_ARC_RAD).then_some(Circle { middle_m, radius_m })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the visible points of an upright object with the outline `at`, a function of the height
    /// and of the angle from the eye.
    fn seen(at: &dyn Fn(f64, f64) -> Vector2<f64>) -> Vec<Point3<f64>> {
        let grid = (0..20).flat_map(|row| (0..21).map(move |column| (row, column)));
        let point = |(row, column): (u32, u32)| {
            let (height_m, angle_rad) = (f64::from(row) * 0.01, f64::from(column) * 0.14 - 1.4);
            let at_m = at(height_m, angle_rad);
            Point3::new(at_m.x, at_m.y, 0.7 + height_m)
        };
        grid.map(point).collect()
    }

    #[test]
    fn what_is_upright_and_round_has_an_axis() {
        let eye_m = Point3::new(0.0, 0.0, 1.2);
        // The angle is measured from the direction to the eye, one metre away against x.
        let round = |radius_m: f64, angle_rad: f64| {
            Vector2::new(1.0 - radius_m * angle_rad.cos(), 0.2 + radius_m * angle_rad.sin())
        };
        let bottle =
            seen(&|height_m, angle_rad| round(if height_m < 0.14 { 0.035 } else { 0.016 }, angle_rad));
        let found = axis(&bottle, &eye_m).unwrap();
        assert!((found.at_m - Vector2::new(1.0, 0.2)).norm() < 1e-6, "{found:?}");
        assert!((found.radius_m - 0.035).abs() < 1e-6 && (found.bottom_m - 0.7).abs() < 1e-9, "{found:?}");
        assert!((found.top_m - 0.89).abs() < 1e-9, "{found:?}");
        let leaning =
            seen(&|height_m, angle_rad| round(0.035, angle_rad) + Vector2::new(0.3 * height_m, 0.0));
        assert_eq!(axis(&leaning, &eye_m), None);
        let wall = seen(&|_, angle_rad| Vector2::new(1.0, 0.1 * angle_rad));
        assert_eq!(axis(&wall, &eye_m), None);
        let edge = seen(&|_, angle_rad| Vector2::new(1.0 + 0.05 * angle_rad.abs(), 0.05 * angle_rad));
        assert_eq!(axis(&edge, &eye_m), None, "the edge of a box");
        let hollow = seen(&|_, angle_rad| Vector2::new(1.0 + 0.05 * angle_rad.cos(), 0.05 * angle_rad.sin()));
        assert_eq!(axis(&hollow, &eye_m), None);
    }
}
