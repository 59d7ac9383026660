//! Self-collision: shapes of one robot that must not meet.

use super::capsule::{Capsule, Segment, closest_points};
use crate::model::Configuration;
use crate::qp::Rows;

/// Pairs of capsules that are kept apart.
#[derive(Clone, Debug, Default)]
pub struct SelfCollision {
    /// Shapes of the robot.
    pub capsules: Vec<Capsule>,
    /// Pairs of indices into `capsules`.
    pub pairs: Vec<[usize; 2]>,
    /// Minimum distance between surfaces, m.
    pub margin_m: f64,
    /// Distance beyond which pairs add no row, m.
    pub range_m: f64,
    /// Share of the distance beyond the margin that one step may take.
    pub gain: f64,
}

/// The pair that is nearest to touching.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPair {
    /// Index into [`SelfCollision::pairs`].
    pub pair: usize,
    /// Distance between surfaces, m; negative if they overlap.
    pub distance_m: f64,
}

/// Distance of axes below which no row is written, m: directions of nearly coincident axes are noise.
const SMALLEST_AXIS_DISTANCE_M: f64 = 1e-6;

impl SelfCollision {
    /// Returns the nearest pair, or `None` if there are no pairs.
    pub fn closest(&self, configuration: &Configuration) -> Option<ClosestPair> {
        let pairs = self.pairs.iter().enumerate().map(|(pair, indices)| {
            let [a, b] = indices.map(|index| &self.capsules[index]);
            let [on_a, on_b] =
                closest_points([a, b].map(|capsule| Segment::of(capsule, configuration).ends()));
            ClosestPair { pair, distance_m: (on_a - on_b).norm() - a.radius_m - b.radius_m }
        });
        pairs.min_by(|a, b| a.distance_m.total_cmp(&b.distance_m))
    }

    /// Writes one row per pair within range, owned by `owner(pair)`. Bounding spheres of the capsules
    /// keep distant pairs cheap.
    pub(crate) fn write<Owner>(
        &self,
        configuration: &Configuration,
        segments: &mut Vec<Segment>,
        rows: &mut Rows<Owner>,
        owner: impl Fn(usize) -> Owner,
    ) {
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
            let row = rows.push(owner(pair));
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
