//! Places on the floor, and paths between them in the manner of a rigid body.

use nalgebra::{Isometry3, Rotation2, Translation3, UnitQuaternion, Vector2, Vector3};
use tandem_sim::{CONTROL_HZ, Pose};
use tandem_tools_spec::Destination;

use crate::convert::isometry_from_sim;

/// Control steps of one walk, about half a gait cycle. The pelvis sways once a cycle, so the mean of two
/// moments half a cycle apart is free of the sway.
pub const WALK_STEPS: u32 = 13;
pub const WALK_S: f64 = WALK_STEPS as f64 / CONTROL_HZ;
/// Length in metres that counts as much as a turn of one radian.
const M_PER_RAD: f64 = 0.5;
/// Fraction of earlier forward errors that a correction adds, and the limit of their sum.
const MISSED_PART: f64 = 0.5;
const MAX_MISS_M: f64 = 0.04;

/// A position and a heading on the floor, in a start frame.
#[derive(Clone, Copy, Debug)]
pub struct Stand {
    pub at_m: Vector2<f64>,
    pub heading_rad: f64,
}

/// Path between two places of a rigid body that turns and shifts at constant rates:
///   p(s) = p_0 + R_0 V(s w) s v,   V(a) = [sin a, -(1 - cos a); 1 - cos a, sin a] / a,   s in 0..=1.
/// v is chosen so that p(1) is the other place. Each point of the body moves along such a path with the
/// same w.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    from: Stand,
    /// v and w, for the whole path.
    pub shift_m: Vector2<f64>,
    pub turn_rad: f64,
}

/// Displacement from one place to another: [ahead, left] in the first one's heading, and the angle.
pub struct Missing {
    pub way_m: Vector2<f64>,
    pub turn_rad: f64,
}

/// Short walks that correct a robot's place. Each also compensates the accumulated forward error of earlier
/// corrections. A stepping robot leans differently from a standing one, and would otherwise stop behind its
/// place every time.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corrections {
    /// Accumulated forward error; `None` before the first correction.
    missed_ahead_m: Option<f64>,
}

impl Stand {
    /// The start frame itself.
    pub const START: Stand = Stand { at_m: Vector2::new(0.0, 0.0), heading_rad: 0.0 };

    pub fn of(start_from_pelvis: &Pose) -> Stand {
        Stand::below(&isometry_from_sim(start_from_pelvis))
    }

    /// Returns the place below a pose in the start frame.
    pub fn below(pose: &Isometry3<f64>) -> Stand {
        let ahead = pose.rotation * Vector3::x();
        Stand { at_m: pose.translation.vector.xy(), heading_rad: ahead.y.atan2(ahead.x) }
    }

    /// Returns the places of a destination for a robot that stands here: its waypoints, then the destination.
    /// `frame` is the place of the destination's frame.
    pub fn places(&self, entry: &Destination, frame: &Stand) -> Vec<Stand> {
        let mut heading_rad = self.heading_rad;
        let waypoints =
            entry.waypoints.iter().flatten().map(|waypoint| (waypoint.at_m, waypoint.heading_rad));
        waypoints
            .chain([(entry.to_m, entry.heading_rad)])
            .map(|(at_m, told_rad)| {
                heading_rad = told_rad.map_or(heading_rad, |told_rad| frame.heading_rad + told_rad);
                let way_m = Rotation2::new(frame.heading_rad) * Vector2::from(at_m);
                Stand { at_m: frame.at_m + way_m, heading_rad }
            })
            .collect()
    }

    pub fn start_from_stand(&self) -> Isometry3<f64> {
        let turned = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading_rad);
        Isometry3::from_parts(Translation3::new(self.at_m.x, self.at_m.y, 0.0), turned)
    }

    pub fn missing_to(&self, to: &Stand) -> Missing {
        Missing {
            way_m: Rotation2::new(-self.heading_rad) * (to.at_m - self.at_m),
            turn_rad: wrapped(to.heading_rad - self.heading_rad),
        }
    }
}

impl Missing {
    /// Returns true if distance and angle are at most these.
    pub fn is_within(&self, most_m: f64, most_rad: f64) -> bool {
        self.way_m.norm() <= most_m && self.turn_rad.abs() <= most_rad
    }

    /// Describes the displacement of the robot `name` from its place.
    pub fn told(&self, name: &str) -> String {
        format!("{name} is {:.3} m and {:.3} rad off its place", self.way_m.norm(), self.turn_rad.abs())
    }
}

impl Corrections {
    /// Returns the base command that corrects the displacement in [`WALK_STEPS`]: ahead, left, turning.
    pub fn pulse(&mut self, missing: &Missing) -> [f64; 3] {
        let [ahead_m, left_m]: [f64; 2] = missing.way_m.into();
        let missed_m = self.missed_ahead_m.map_or(0.0, |missed_m| missed_m + MISSED_PART * ahead_m);
        let missed_m = missed_m.clamp(-MAX_MISS_M, MAX_MISS_M);
        self.missed_ahead_m = Some(missed_m);
        [ahead_m + missed_m, left_m, missing.turn_rad].map(|way| way * CONTROL_HZ / f64::from(WALK_STEPS))
    }
}

impl Way {
    pub fn new(from: Stand, to: Stand) -> Way {
        let Missing { way_m, turn_rad } = from.missing_to(&to);
        // V^-1 = [c, w/2; -w/2, c], c = w/2 / tan(w/2)
        let half = 0.5 * turn_rad;
        let c = if half.abs() < 1e-6 { 1.0 } else { half / half.tan() };
        let shift_m = Vector2::new(c * way_m.x + half * way_m.y, c * way_m.y - half * way_m.x);
        Way { from, shift_m, turn_rad }
    }

    /// Returns the length, with a turn converted by [`M_PER_RAD`].
    pub fn length_m(&self) -> f64 {
        self.shift_m.norm().max(M_PER_RAD * self.turn_rad.abs())
    }

    /// Returns the place after a fraction of the path.
    pub fn at(&self, share: f64) -> Stand {
        let angle = share * self.turn_rad;
        let (sine, versine) = if angle.abs() < 1e-6 {
            (1.0, 0.5 * angle)
        } else {
            (angle.sin() / angle, (1.0 - angle.cos()) / angle)
        };
        let [x, y]: [f64; 2] = (share * self.shift_m).into();
        let moved_m = Vector2::new(sine * x - versine * y, versine * x + sine * y);
        Stand {
            at_m: self.from.at_m + Rotation2::new(self.from.heading_rad) * moved_m,
            heading_rad: self.from.heading_rad + angle,
        }
    }
}

/// Wraps an angle to the range from -pi to pi.
pub fn wrapped(angle_rad: f64) -> f64 {
    (angle_rad + std::f64::consts::PI).rem_euclid(2.0 * std::f64::consts::PI) - std::f64::consts::PI
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    fn stand(x_m: f64, y_m: f64, heading_rad: f64) -> Stand {
        Stand { at_m: Vector2::new(x_m, y_m), heading_rad }
    }

    /// Two robots face each other across a load, each with its own start frame. Their relative pose stays
    /// constant along their paths.
    #[test]
    fn robots_whose_places_fit_go_as_one_body() {
        // The pose of B's start frame in A's, and the place of B relative to A.
        let a_from_b = stand(1.3, 0.1, 2.9).start_from_stand();
        let stand_from_partner = stand(1.2, 0.05, PI).start_from_stand();
        let b_of = |a: &Stand| {
            let there = a_from_b.inverse() * a.start_from_stand() * stand_from_partner;
            let ahead = there.rotation * Vector3::x();
            stand(there.translation.x, there.translation.y, ahead.y.atan2(ahead.x))
        };
        let (from, to) = (stand(0.1, -0.2, 0.3), stand(-0.6, 0.9, 1.5));
        let ways = [Way::new(from, to), Way::new(b_of(&from), b_of(&to))];
        for part in [0.0, 0.3, 0.5, 0.8, 1.0] {
            let [a, b] = ways.map(|way| way.at(part));
            let fits = b_of(&a);
            assert!((fits.at_m - b.at_m).norm() < 1e-9, "{part}: {fits:?} and {b:?}");
            assert!(wrapped(fits.heading_rad - b.heading_rad).abs() < 1e-9, "{part}");
        }
        for (part, end) in [(0.0, from), (1.0, to)] {
            let at = ways[0].at(part);
            assert!((at.at_m - end.at_m).norm() < 1e-9 && (at.heading_rad - end.heading_rad).abs() < 1e-9);
        }
        let straight = Way::new(stand(0.0, 0.0, 0.5), stand(1.0, 2.0, 0.5));
        assert!((straight.at(0.5).at_m - Vector2::new(0.5, 1.0)).norm() < 1e-9, "{straight:?}");
    }

    /// Every correction of this robot ends 1.5 cm behind its place. It still gets closer with each.
    #[test]
    fn short_walks_make_up_for_what_they_miss() {
        let mut corrections = Corrections::default();
        let mut missing = stand(1.0, 1.0, PI / 2.0).missing_to(&stand(0.97, 1.05, PI / 2.0 + 0.02));
        assert!(
            missing.is_within(0.06, 0.021)
                && !missing.is_within(0.05, 0.021)
                && !missing.is_within(0.06, 0.01)
        );
        for (ahead_m, left_m, turn_rad) in [(0.05, 0.03, 0.02), (0.0225, 0.0, 0.0), (0.01875, 0.0, 0.0)] {
            let pulse = corrections.pulse(&missing).map(|rate| rate * f64::from(WALK_STEPS) / CONTROL_HZ);
            for (found, expected) in pulse.into_iter().zip([ahead_m, left_m, turn_rad]) {
                assert!((found - expected).abs() < 1e-9, "{pulse:?}");
            }
            missing.way_m -= Vector2::new(pulse[0] - 0.015, pulse[1]);
            missing.turn_rad -= pulse[2];
        }
        assert!(missing.is_within(0.004, 1e-9), "{}", missing.way_m);
    }

    #[test]
    fn headings_that_are_not_told_stay_as_before() {
        let entry = serde_json::json!({
            "robot": "A", "to_m": [1.0, 1.0],
            "waypoints": [{ "at_m": [0.5, 0.0] }, { "at_m": [1.0, 0.0], "heading_rad": 1.5 }],
        });
        let entry = serde_json::from_value(entry).unwrap();
        let told = |frame: Stand| -> Vec<[f64; 3]> {
            let places = stand(0.0, 0.0, 0.2).places(&entry, &frame);
            places.iter().map(|place| [place.at_m.x, place.at_m.y, place.heading_rad]).collect()
        };
        assert_eq!(told(Stand::START), [[0.5, 0.0, 0.2], [1.0, 0.0, 1.5], [1.0, 1.0, 1.5]]);
        // This frame faces left, so places ahead in it are to the left. The present heading is not changed.
        let quarter_rad = std::f64::consts::FRAC_PI_2;
        let expected = [[2.0, 0.5, 0.2], [2.0, 1.0, 1.5 + quarter_rad], [1.0, 1.0, 1.5 + quarter_rad]];
        let found = told(stand(2.0, 0.0, quarter_rad));
        for (found, expected) in found.as_flattened().iter().zip(expected.as_flattened()) {
            assert!((found - expected).abs() < 1e-9, "{found:?}, {expected:?}");
        }
    }
}
