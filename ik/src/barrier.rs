//! Barriers: distances that must not shrink below a margin, as linear constraints on dq.
//!
//! For a distance h(q) with margin m the row  dh/dq dq >= -gain (h - m)  lets h approach m exponentially and not cross
//! it. Source: Ames et al., Control barrier functions: theory and applications, 2019.
//!
//! Rows come and go without a jump in dq if the range, where a pair's row first appears, is so far out that the row does
//! not bind there:  gain (range - margin) >= what the joints can close in one step.

use nalgebra::{Point3, Vector3};

use crate::program::{RowOwner, Rows};
use crate::qp::Row;
use crate::{Configuration, FrameId};

/// A sphere swept along a segment, fixed to a frame; a sphere if both ends are the same.
#[derive(Clone, Debug)]
pub struct Capsule {
    /// Frame that it moves with.
    pub frame: FrameId,
    /// Ends of the segment in that frame, m.
    pub ends: [Point3<f64>; 2],
    /// m.
    pub radius_m: f64,
}

/// Keeps pairs of capsules apart.
#[derive(Clone, Debug, Default)]
pub struct SelfCollision {
    /// Shapes of the robot.
    pub capsules: Vec<Capsule>,
    /// Pairs of indices into `capsules`.
    pub pairs: Vec<[usize; 2]>,
    /// Distance between surfaces that is kept, m.
    pub margin_m: f64,
    /// Pairs further apart than this add no row, m.
    pub range_m: f64,
    /// Part of the distance beyond the margin that one step may take.
    pub gain: f64,
}

/// The pair that is nearest to touching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPair {
    /// Index into [`SelfCollision::pairs`].
    pub pair: usize,
    /// Distance between surfaces, m; negative where they overlap.
    pub distance_m: f64,
}

/// Directions of nearly coincident axes are noise: below this distance no row is written, m.
const SMALLEST_AXIS_DISTANCE_M: f64 = 1e-6;

/// A capsule's axis in the root's frame, m.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Segment {
    centre: Vector3<f64>,
    /// From the centre to the second end.
    half: Vector3<f64>,
    half_length: f64,
}

impl Segment {
    fn of(capsule: &Capsule, configuration: &Configuration) -> Segment {
        let pose = configuration.root_from_frame(capsule.frame);
        let [first, second] = capsule.ends.map(|end| (pose * end).coords);
        let half = (second - first) * 0.5;
        Segment { centre: (first + second) * 0.5, half, half_length: half.norm() }
    }

    fn ends(&self) -> [Vector3<f64>; 2] {
        [self.centre - self.half, self.centre + self.half]
    }
}

impl SelfCollision {
    /// Nearest pair, if there are any.
    pub fn closest(&self, configuration: &Configuration) -> Option<ClosestPair> {
        let pairs = self.pairs.iter().enumerate().map(|(pair, indices)| {
            let [a, b] = indices.map(|index| &self.capsules[index]);
            let [on_a, on_b] =
                closest_points([a, b].map(|capsule| Segment::of(capsule, configuration).ends()));
            ClosestPair { pair, distance_m: (on_a - on_b).norm() - a.radius_m - b.radius_m }
        });
        pairs.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
    }

    /// Writes one row per pair within range; spheres about the capsules keep distant pairs cheap.
    pub(crate) fn write(&self, configuration: &Configuration, segments: &mut Vec<Segment>, rows: &mut Rows) {
        segments.clear();
        segments.extend(self.capsules.iter().map(|capsule| Segment::of(capsule, configuration)));
        for (pair, &[first, second]) in self.pairs.iter().enumerate() {
            let (a, b) = (&segments[first], &segments[second]);
            let radii = self.capsules[first].radius_m + self.capsules[second].radius_m;
            let within = self.range_m + radii + a.half_length + b.half_length;
            if (a.centre - b.centre).norm_squared() > within * within {
                continue;
            }
            let [on_a, on_b] = closest_points([a.ends(), b.ends()]);
            let axis = on_a - on_b;
            let distance_m = axis.norm() - radii;
            if distance_m > self.range_m || axis.norm() < SMALLEST_AXIS_DISTANCE_M {
                continue;
            }
            let normal = axis.normalize();
            let row = rows.push(RowOwner::SelfCollision(pair));
            for (capsule, point, sign) in [(first, on_a, 1.0), (second, on_b, -1.0)] {
                for &joint in configuration.model().support(self.capsules[capsule].frame) {
                    row.coefficients[joint] +=
                        sign * normal.dot(&configuration.velocity_of_point(&point, joint).0);
                }
            }
            row.bound = -self.gain * (distance_m - self.margin_m);
        }
    }
}

/// Keeps the origin of a frame on one side of a plane: normal . p >= offset, in the root's frame.
#[derive(Clone, Debug)]
pub struct PositionBarrier {
    /// The frame.
    pub frame: FrameId,
    /// Unit vector to the free side.
    pub normal: Vector3<f64>,
    /// m.
    pub offset_m: f64,
    /// Part of the distance that one step may take.
    pub gain: f64,
}

impl PositionBarrier {
    /// Distance of the frame's origin to the plane, m; negative beyond it.
    pub fn height_m(&self, configuration: &Configuration) -> f64 {
        self.normal.dot(&configuration.root_from_frame(self.frame).translation.vector) - self.offset_m
    }

    pub(crate) fn write(&self, configuration: &Configuration, row: &mut Row) {
        let point = configuration.root_from_frame(self.frame).translation.vector;
        for &joint in configuration.model().support(self.frame) {
            row.coefficients[joint] = self.normal.dot(&configuration.velocity_of_point(&point, joint).0);
        }
        row.bound = -self.gain * self.height_m(configuration);
    }
}

/// Closest points of two segments. Source: Ericson, Real-time collision detection, 2004, section 5.1.9.
fn closest_points([a, b]: [[Vector3<f64>; 2]; 2]) -> [Vector3<f64>; 2] {
    let (da, db, between) = (a[1] - a[0], b[1] - b[0], a[0] - b[0]);
    let (aa, bb, f) = (da.norm_squared(), db.norm_squared(), db.dot(&between));
    let point_like = 1e-18;
    let (s, t) = if aa <= point_like && bb <= point_like {
        (0.0, 0.0)
    } else if aa <= point_like {
        (0.0, (f / bb).clamp(0.0, 1.0))
    } else {
        let c = da.dot(&between);
        if bb <= point_like {
            ((-c / aa).clamp(0.0, 1.0), 0.0)
        } else {
            let ab = da.dot(&db);
            let parallel = aa * bb - ab * ab;
            let s =
                if parallel > 1e-12 * aa * bb { ((ab * f - c * bb) / parallel).clamp(0.0, 1.0) } else { 0.5 };
            let t = (ab * s + f) / bb;
            if t < 0.0 {
                ((-c / aa).clamp(0.0, 1.0), 0.0)
            } else if t > 1.0 {
                (((ab - c) / aa).clamp(0.0, 1.0), 1.0)
            } else {
                (s, t)
            }
        }
    };
    [a[0] + da * s, b[0] + db * t]
}
