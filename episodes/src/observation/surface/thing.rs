//! The object at a pixel, whatever its colours: the region connected to it by continuous depth, across convex
//! edges. The region does not extend across concave corners, for example where the object meets a table.
//! After Stein et al., "Object partitioning using local convexity", 2014.

use std::collections::BTreeSet;

use nalgebra::{Point3, Unit, Vector3};

use super::grow;
use crate::observation::RobotView;

/// Cosine of the maximum angle at a concave edge within one object, for nearly flat objects and for
/// hollows such as a bottle's neck.
const HOLLOW_COS: f64 = 0.94;
/// Maximum distance of a neighbour from both tangent planes, also as a fraction of the distance between
/// the points. Beyond it, the neighbour is behind the nearer object's edge.
const OFF_PLANE_M: f64 = 0.003;
const OFF_PLANE_PART: f64 = 0.25;

/// Points and normals of an image's pixels, in the camera's frame.
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
        // The slope along a row or column, from the nearer of the two neighbours; the other may belong to
        // an object behind.
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

    /// Returns the area visible in a pixel, up to a constant factor.
    pub fn area(&self, pixel: usize) -> f64 {
        let (Some(point_m), Some(normal)) = (self.points_m[pixel], &self.normals[pixel]) else { return 0.0 };
        let towards = -point_m.coords.normalize().dot(normal);
        point_m.z.powi(2) / towards.max(0.2)
    }

    /// Returns every pixel of the object at `seed`.
    pub fn thing(&self, view: &RobotView, seed: usize) -> Vec<usize> {
        grow(view, seed, &mut vec![false; view.depth_m.len()], &|one, other| self.are_of_one(one, other))
    }

    /// Unites the regions of one colour that belong to one object, for example a bottle's two rings. A region
    /// larger than `max_pixels` is part of the room, and is not united with others.
    pub fn unite(&self, view: &RobotView, regions: Vec<Vec<usize>>, max_pixels: usize) -> Vec<Vec<usize>> {
        let mut left = regions;
        left.sort_by_key(|region| region.len());
        let mut united = Vec::new();
        while let Some(mut region) = left.pop() {
            let thing: BTreeSet<usize> = self.thing(view, region[region.len() / 2]).into_iter().collect();
            if thing.len() <= max_pixels {
                let is_part = |other: &Vec<usize>| {
                    2 * other.iter().filter(|pixel| thing.contains(pixel)).count() > other.len()
                };
                let (parts, others): (Vec<_>, Vec<_>) = left.into_iter().partition(is_part);
                left = others;
                region.extend(parts.concat());
            }
            united.push(region);
        }
        united
    }

    /// Returns true if two neighbouring pixels belong to one object.
    fn are_of_one(&self, one: usize, other: usize) -> bool {
        let (Some(from_m), Some(to_m)) = (self.points_m[one], self.points_m[other]) else { return false };
        let (Some(from), Some(to)) = (&self.normals[one], &self.normals[other]) else { return false };
        let way_m = to_m - from_m;
        let off_m = from.dot(&way_m).abs().min(to.dot(&way_m).abs());
        let goes_on = off_m < OFF_PLANE_M + OFF_PLANE_PART * way_m.norm();
        goes_on && (from.dot(to) > HOLLOW_COS || (to.into_inner() - from.into_inner()).dot(&way_m) > 0.0)
    }
}
