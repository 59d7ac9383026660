//! The thing at a pixel, whatever its colours: what is joined to it in the picture by depth that goes on, over edges that stand out but
//! not over corners that go in, as where it stands on a table. After Stein et al., "Object partitioning using local convexity", 2014.

use nalgebra::{Point3, Unit, Vector3};

use super::grow;
use crate::observation::RobotView;

/// Surfaces that turn towards each other by less are one: of things that are nearly flat, and of hollows as a bottle's neck has.
const HOLLOW_COS: f64 = 0.94;
/// What lies off the planes of both neighbours by more, and by more than this part of the way, is behind an edge of the nearer one.
const OFF_PLANE_M: f64 = 0.003;
const OFF_PLANE_PART: f64 = 0.25;

/// What each pixel of a picture sees, in the camera's frame: where, and which way that faces.
pub struct Relief {
    points_m: Vec<Option<Point3<f64>>>,
    normals: Vec<Option<Unit<Vector3<f64>>>>,
}

impl Relief {
    pub fn of(view: &RobotView) -> Relief {
        let (width, height) = (view.picture.width as usize, view.picture.height as usize);
        let point_m = |pixel: usize| {
            let (uv_px, depth_m) = ([(pixel % width) as f32, (pixel / width) as f32], view.depth_m[pixel]);
            let at_m = view.intrinsics.unproject(uv_px, depth_m);
            depth_m.is_finite().then(|| Point3::from(at_m.to_array().map(f64::from)))
        };
        let points_m: Vec<_> = (0..width * height).map(point_m).collect();
        // The slope along a row or a column, by the nearer of the two neighbours: the other may be of something behind.
        let slope = |pixel: usize, before: Option<usize>, after: Option<usize>| {
            let here_m = points_m[pixel]?;
            let to = |other: Option<usize>, sign: f64| Some(sign * (points_m[other?]? - here_m));
            let slopes = [to(before, -1.0), to(after, 1.0)].into_iter().flatten();
            slopes.min_by(|one, other| one.norm_squared().total_cmp(&other.norm_squared()))
        };
        let normal = |pixel: usize| {
            let (u, v) = (pixel % width, pixel / width);
            let across = slope(pixel, (u > 0).then(|| pixel - 1), (u + 1 < width).then(|| pixel + 1))?;
            let down = slope(pixel, (v > 0).then(|| pixel - width), (v + 1 < height).then(|| pixel + width))?;
            let normal = Unit::try_new(across.cross(&down), 1e-12)?;
            let away = points_m[pixel]?.coords.dot(&normal) > 0.0;
            Some(if away { -normal } else { normal })
        };
        let normals = (0..width * height).map(normal).collect();
        Relief { points_m, normals }
    }

    pub fn point_m(&self, pixel: usize) -> Option<Point3<f64>> {
        self.points_m[pixel]
    }

    /// The area that a pixel sees, to a factor.
    pub fn area(&self, pixel: usize) -> f64 {
        let (Some(point_m), Some(normal)) = (self.points_m[pixel], &self.normals[pixel]) else { return 0.0 };
        let towards = -point_m.coords.normalize().dot(normal);
        point_m.z.powi(2) / towards.max(0.2)
    }

    /// Every pixel of the thing that `seed` sees.
    pub fn thing(&self, view: &RobotView, seed: usize) -> Vec<usize> {
        grow(view, seed, &mut vec![false; view.depth_m.len()], &|one, other| self.are_of_one(one, other))
    }

    /// Whether two neighbours are of one thing.
    fn are_of_one(&self, one: usize, other: usize) -> bool {
        let (Some(from_m), Some(to_m)) = (self.points_m[one], self.points_m[other]) else { return false };
        let (Some(from), Some(to)) = (&self.normals[one], &self.normals[other]) else { return false };
        let way_m = to_m - from_m;
        let off_m = from.dot(&way_m).abs().min(to.dot(&way_m).abs());
        let goes_on = off_m < OFF_PLANE_M + OFF_PLANE_PART * way_m.norm();
        goes_on && (from.dot(to) > HOLLOW_COS || (to.into_inner() - from.into_inner()).dot(&way_m) > 0.0)
    }
}
