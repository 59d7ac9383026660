//! Fit of the largest plane in an image region, of its straight edges within the region, and of their
//! corners. The fit uses only depth that the policy may measure itself.

use nalgebra::{Isometry3, Matrix2, Matrix3, Point3, SymmetricEigen, Vector2, Vector3};
use tandem_sim::SplitMix64;
use tandem_tools_spec::{EdgeFit, PlaneFit, RegionFit};

use super::RobotView;
use crate::convert::coarse;

/// Maximum distance of points from their plane, and the same as a fraction of their distance from the camera.
const PLANE_OFF_M: f64 = 0.003;
const PLANE_OFF_SHARE: f64 = 0.003;
/// Maximum distance of points from their edge.
const EDGE_OFF_M: f64 = 0.004;
const TRIALS: usize = 200;
/// Minimum number of points on a plane, and their minimum fraction of the points in the region.
const MIN_PLANE_POINTS: usize = 30;
const MIN_PLANE_SHARE: f64 = 0.2;
const MIN_EDGE_POINTS: usize = 12;
const MIN_EDGE_M: f64 = 0.03;
const MAX_EDGES: usize = 4;
/// Minimum angle between edges that meet at a corner, and maximum distance between their ends and the corner.
const MIN_CORNER_RAD: f64 = 0.35;
const MAX_CORNER_GAP_M: f64 = 0.03;

/// Pixels in a rectangle of a view, with their points in the camera's frame.
struct Region<'a> {
    view: &'a RobotView,
    from: [usize; 2],
    to: [usize; 2],
}

/// A plane in the camera's frame.
#[derive(Clone, Copy)]
struct Plane {
    normal: Vector3<f64>,
    point_m: Vector3<f64>,
}

/// A straight line on a plane, in the plane's own coordinates.
#[derive(Clone, Copy)]
struct Line {
    point_m: Vector2<f64>,
    along: Vector2<f64>,
}

/// A straight stretch of a boundary.
struct Edge {
    line: Line,
    /// Coordinates of its start and end along the line.
    ends_m: [f64; 2],
    /// Root mean square of the points' distances from the line.
    rms_m: f64,
    points: usize,
}

/// Fits the region between two corners of the image. The result is in the frame in which the camera has
/// this pose.
pub fn fit(
    view: &RobotView,
    corners: [[i64; 2]; 2],
    frame_from_camera: &Isometry3<f64>,
) -> Option<RegionFit> {
    let [from, to] = [i64::min, i64::max].map(|pick: fn(i64, i64) -> i64| {
        std::array::from_fn(|axis| pick(corners[0][axis], corners[1][axis]) as usize)
    });
    let region = Region { view, from, to };
    let points_m: Vec<Vector3<f64>> = region.pixels().filter_map(|at| region.point_m(at)).collect();
    let (plane, rms_m, count) = fit_plane(&points_m)?;
    let share = count as f64 / points_m.len() as f64;
    if count < MIN_PLANE_POINTS || share < MIN_PLANE_SHARE {
        return None;
    }
    let tell = |point_m: Vector3<f64>| -> [f64; 3] {
        let told_m: Vector3<f64> = (frame_from_camera * Point3::from(point_m)).coords;
        [told_m.x, told_m.y, told_m.z].map(coarse)
    };
    let normal = frame_from_camera * plane.normal;
    let axes = plane.axes();
    let on_plane = |at_m: Vector2<f64>| plane.point_m + axes[0] * at_m.x + axes[1] * at_m.y;
    let edges = edges(region.boundary(&plane));
    let told = |Edge { line, ends_m: [start_m, end_m], rms_m, points }: &Edge| EdgeFit {
        from_m: tell(on_plane(line.at(*start_m))),
        to_m: tell(on_plane(line.at(*end_m))),
        rms_m: coarse(*rms_m),
        points: *points as u32,
    };
    Some(RegionFit {
        plane: PlaneFit {
            point_m: tell(plane.point_m),
            normal: [normal.x, normal.y, normal.z].map(coarse),
            rms_m: coarse(rms_m),
            pixels: count as u32,
            share: coarse(share),
        },
        edges: edges.iter().map(told).collect(),
        corners_m: corners_of(&edges).into_iter().map(|corner_m| tell(on_plane(corner_m))).collect(),
    })
}

impl Region<'_> {
    fn pixels(&self) -> impl Iterator<Item = [usize; 2]> {
        let ([left, top], [right, bottom]) = (self.from, self.to);
        (top..=bottom).flat_map(move |v| (left..=right).map(move |u| [u, v]))
    }

    fn point_m(&self, [u, v]: [usize; 2]) -> Option<Vector3<f64>> {
        let depth_m = self.view.depth_m[v * self.view.picture.width as usize + u];
        let seen_m = self.view.intrinsics.unproject([u as f32, v as f32], depth_m);
        depth_m.is_finite().then(|| Vector3::from(seen_m.to_array().map(f64::from)))
    }

    /// Returns the plane's boundary in the region, in the plane's coordinates: the points between each of
    /// its pixels and a neighbour off the plane.
    fn boundary(&self, plane: &Plane) -> Vec<Vector2<f64>> {
        let axes = plane.axes();
        let is_of_it = |at| self.point_m(at).is_some_and(|point_m| plane.has(&point_m));
        let mut found = Vec::new();
        for [u, v] in self.pixels().filter(|at| is_of_it(*at)) {
            let beside = [[u.wrapping_sub(1), v], [u + 1, v], [u, v.wrapping_sub(1)], [u, v + 1]];
            let within =
                |at: &[usize; 2]| (0..2).all(|axis| (self.from[axis]..=self.to[axis]).contains(&at[axis]));
            for other in beside.into_iter().filter(|other| within(other) && !is_of_it(*other)) {
                let halfway = [u + other[0], v + other[1]].map(|sum| sum as f32 / 2.0);
                let ray =
                    Vector3::from(self.view.intrinsics.unproject(halfway, 1.0).to_array().map(f64::from));
                let along = plane.normal.dot(&ray);
                if along.abs() > 1e-6 {
                    let away_m = ray * (plane.normal.dot(&plane.point_m) / along) - plane.point_m;
                    found.push(Vector2::new(axes[0].dot(&away_m), axes[1].dot(&away_m)));
                }
            }
        }
        found
    }
}

impl Plane {
    /// Returns the least-squares plane through the mean of these points, with its normal towards the camera.
    fn nearest<'a>(points: impl Iterator<Item = &'a Vector3<f64>> + Clone) -> Plane {
        let count = points.clone().count() as f64;
        let middle_m = points.clone().sum::<Vector3<f64>>() / count;
        let spread: Matrix3<f64> =
            points.map(|point_m| (point_m - middle_m) * (point_m - middle_m).transpose()).sum();
        let eigen = SymmetricEigen::new(spread);
        let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned();
        let towards = if normal.dot(&middle_m) > 0.0 { -normal } else { normal };
        Plane { normal: towards, point_m: middle_m }
    }

    fn off_m(&self, point_m: &Vector3<f64>) -> f64 {
        self.normal.dot(&(point_m - self.point_m))
    }

    fn has(&self, point_m: &Vector3<f64>) -> bool {
        self.off_m(point_m).abs() < PLANE_OFF_M + PLANE_OFF_SHARE * point_m.norm()
    }

    /// Returns two orthogonal directions in the plane.
    fn axes(&self) -> [Vector3<f64>; 2] {
        let aside = if self.normal.x.abs() < 0.9 { Vector3::x() } else { Vector3::y() };
        let first = (aside - self.normal * self.normal.dot(&aside)).normalize();
        [first, self.normal.cross(&first)]
    }
}

/// Returns the plane with the most of these points, the root mean square of their distances, and their
/// number.
fn fit_plane(points_m: &[Vector3<f64>]) -> Option<(Plane, f64, usize)> {
    if points_m.len() < MIN_PLANE_POINTS {
        return None;
    }
    let mut random = SplitMix64(points_m.len() as u64);
    let mut draw = || points_m[random.uniform([0.0, points_m.len() as f32]) as usize % points_m.len()];
    let mut best: Option<(Plane, usize)> = None;
    for _ in 0..TRIALS {
        let [a, b, c] = [draw(), draw(), draw()];
        let across = (b - a).cross(&(c - a));
        if across.norm() > 1e-9 {
            let plane = Plane { normal: across.normalize(), point_m: a };
            let count = points_m.iter().filter(|point_m| plane.has(point_m)).count();
            if best.is_none_or(|(_, most)| count > most) {
                best = Some((plane, count));
            }
        }
    }
    let mut plane = best?.0;
    for _ in 0..3 {
        plane = Plane::nearest(
            points_m.iter().filter(|point_m| plane.has(point_m)).collect::<Vec<_>>().into_iter(),
        );
    }
    let own = points_m.iter().filter(|point_m| plane.has(point_m));
    let (sum_m2, count) = own.fold((0.0, 0), |(sum, count), at| (sum + plane.off_m(at).powi(2), count + 1));
    (count > 0).then(|| (plane, (sum_m2 / count as f64).sqrt(), count))
}

impl Line {
    fn nearest(points: &[Vector2<f64>]) -> Line {
        let middle_m = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
        let spread: Matrix2<f64> =
            points.iter().map(|at| (at - middle_m) * (at - middle_m).transpose()).sum();
        let eigen = SymmetricEigen::new(spread);
        Line { point_m: middle_m, along: eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned() }
    }

    fn at(&self, along_m: f64) -> Vector2<f64> {
        self.point_m + self.along * along_m
    }

    fn off_m(&self, at_m: &Vector2<f64>) -> f64 {
        self.along.perp(&(at_m - self.point_m))
    }

    fn along_m(&self, at_m: &Vector2<f64>) -> f64 {
        self.along.dot(&(at_m - self.point_m))
    }
}

/// Returns the straight edges in the points of a boundary, the longest first.
fn edges(mut points: Vec<Vector2<f64>>) -> Vec<Edge> {
    let mut found = Vec::new();
    let mut random = SplitMix64(points.len() as u64);
    while found.len() < MAX_EDGES && points.len() >= MIN_EDGE_POINTS {
        let mut draw = || points[random.uniform([0.0, points.len() as f32]) as usize % points.len()];
        let mut best: (usize, Vec<Vector2<f64>>) = (0, Vec::new());
        for _ in 0..TRIALS {
            let [a, b] = [draw(), draw()];
            if (b - a).norm() > MIN_EDGE_M / 2.0 {
                let line = Line { point_m: a, along: (b - a).normalize() };
                let own: Vec<_> =
                    points.iter().copied().filter(|at| line.off_m(at).abs() < EDGE_OFF_M).collect();
                if own.len() > best.0 {
                    best = (own.len(), own);
                }
            }
        }
        if best.0 < MIN_EDGE_POINTS {
            break;
        }
        let line = Line::nearest(&best.1);
        let own: Vec<_> = points.iter().copied().filter(|at| line.off_m(at).abs() < EDGE_OFF_M).collect();
        if own.len() < MIN_EDGE_POINTS {
            break;
        }
        let line = Line::nearest(&own);
        let ends_m = own
            .iter()
            .map(|at| line.along_m(at))
            .fold([f64::MAX, f64::MIN], |[low, high], at_m| [low.min(at_m), high.max(at_m)]);
        let rms_m = (own.iter().map(|at| line.off_m(at).powi(2)).sum::<f64>() / own.len() as f64).sqrt();
        points.retain(|at| line.off_m(at).abs() >= EDGE_OFF_M);
        if ends_m[1] - ends_m[0] >= MIN_EDGE_M {
            found.push(Edge { line, ends_m, rms_m, points: own.len() });
        }
    }
    let length_m = |edge: &Edge| edge.ends_m[1] - edge.ends_m[0];
    found.sort_by(|one, other| length_m(other).total_cmp(&length_m(one)));
    found
}

/// Returns the corners: intersections of two edges that both extend to them.
fn corners_of(edges: &[Edge]) -> Vec<Vector2<f64>> {
    let mut found = Vec::new();
    for (index, Edge { line: one, .. }) in edges.iter().enumerate() {
        for other in &edges[index + 1..] {
            let turn = one.along.perp(&other.line.along);
            if turn.abs() < MIN_CORNER_RAD.sin() {
                continue;
            }
            let corner_m = one.at((other.line.point_m - one.point_m).perp(&other.line.along) / turn);
            let reaches = |Edge { line, ends_m: [start_m, end_m], .. }: &Edge| {
                let along_m = line.along_m(&corner_m);
                along_m > start_m - MAX_CORNER_GAP_M && along_m < end_m + MAX_CORNER_GAP_M
            };
            if reaches(&edges[index]) && reaches(other) {
                found.push(corner_m);
            }
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use tandem_sim::render::{Distortion, Frame, Intrinsics};

    use super::*;

    const WIDTH: usize = 160;
    const HEIGHT: usize = 120;
    const FOCAL_PX: f32 = 130.0;

    /// Returns a view of a table of 0.6 x 0.4 m with a wall behind it. The table is 1 m away, rotated by
    /// 0.3 rad about the viewing direction and tilted by `lean_rad`.
    fn view(lean_rad: f64, wall_m: f32) -> RobotView {
        let plane = Isometry3::new(Vector3::new(0.0, 0.0, -1.0), Vector3::new(lean_rad, 0.0, 0.0))
            * Isometry3::rotation(Vector3::z() * 0.3);
        let intrinsics = Intrinsics {
            width: WIDTH as u32,
            height: HEIGHT as u32,
            focal_px: FOCAL_PX,
            cx: (WIDTH as f32 - 1.0) / 2.0,
            cy: (HEIGHT as f32 - 1.0) / 2.0,
            distortion: Distortion::NONE,
        };
        let depth_m = (0..WIDTH * HEIGHT).map(|pixel| {
            let at = [(pixel % WIDTH) as f32, (pixel / WIDTH) as f32];
            let ray = Vector3::from(intrinsics.unproject(at, 1.0).to_array().map(f64::from));
            let normal = plane.rotation * Vector3::z();
            let depth_m = normal.dot(&plane.translation.vector) / normal.dot(&ray);
            let own_m = plane.inverse() * Point3::from(ray * depth_m);
            if own_m.x.abs() <= 0.3 && own_m.y.abs() <= 0.2 { depth_m as f32 } else { wall_m }
        });
        let (width, height) = (WIDTH as u32, HEIGHT as u32);
        let depth_m = depth_m.collect();
        let frame =
            Frame { width, height, rgb: vec![0; 3 * WIDTH * HEIGHT], depth_m, ids: vec![0; WIDTH * HEIGHT] };
        RobotView::new(intrinsics, frame)
    }

    fn distance_m(one_m: [f64; 3], other_m: [f64; 3]) -> f64 {
        (Vector3::from(one_m) - Vector3::from(other_m)).norm()
    }

    #[test]
    fn a_table_has_its_plane_four_edges_and_four_corners() {
        for lean_rad in [0.0, 0.5, -0.8] {
            let found =
                fit(&view(lean_rad, f32::INFINITY), [[5, 5], [155, 115]], &Isometry3::identity()).unwrap();
            let PlaneFit { point_m, normal, rms_m, share, .. } = found.plane;
            let turned = Isometry3::rotation(Vector3::new(lean_rad, 0.0, 0.0));
            let expected = turned * Vector3::z();
            assert!(Vector3::from(normal).angle(&expected) < 0.01, "{normal:?}");
            assert!(
                distance_m(point_m, [0.0, 0.0, -1.0]) < 0.05 && rms_m <= 0.001 && share > 0.2,
                "{point_m:?}"
            );
            assert_eq!((found.edges.len(), found.corners_m.len()), (4, 4), "{lean_rad}: {found:?}");
            let table =
                Isometry3::translation(0.0, 0.0, -1.0) * turned * Isometry3::rotation(Vector3::z() * 0.3);
            for [x_m, y_m] in [[0.3, 0.2], [-0.3, 0.2], [0.3, -0.2], [-0.3, -0.2]] {
                let corner_m: [f64; 3] = (table * Point3::new(x_m, y_m, 0.0)).coords.into();
                let off_m =
                    found.corners_m.iter().map(|found_m| distance_m(*found_m, corner_m)).fold(1.0, f64::min);
                assert!(off_m < 0.006, "{lean_rad}: {off_m} of {corner_m:?}");
            }
        }
    }

    #[test]
    fn a_corner_alone_and_no_plane_at_all() {
        let view = view(0.0, 2.0);
        let corner = fit(&view, [[5, 5], [80, 60]], &Isometry3::identity()).unwrap();
        assert!(corner.edges.len() >= 2 && !corner.corners_m.is_empty(), "{corner:?}");
        let wall = fit(&view, [[0, 0], [12, 12]], &Isometry3::identity()).unwrap();
        assert!(wall.edges.is_empty() && (wall.plane.point_m[2] + 2.0).abs() < 1e-3, "{wall:?}");
        assert_eq!(fit(&view, [[80, 60], [83, 63]], &Isometry3::identity()), None, "16 pixels are too few");
    }
}
