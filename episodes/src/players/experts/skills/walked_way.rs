//! Path of an object that several robots carry. Its length is measured by the robot that has farthest to
//! walk. When the object turns, robots at its ends walk farther than its middle moves.

use tandem_sim::Pose;

/// Number of pieces in which a stretch between two stops is measured.
const PIECES: usize = 16;

/// A path that is straight from stop to stop, with a uniform turn along each stretch.
pub struct WalkedWay {
    stretches: Vec<Stretch>,
}

struct Stretch {
    from: Pose,
    to: Pose,
    length_m: f32,
}

impl Stretch {
    fn at(&self, share: f32) -> Pose {
        self.from.lerp(&self.to, share)
    }
}

impl WalkedWay {
    /// Creates the path through `stops` of the object, world frame. The robots stand at `object_from_stand`,
    /// in the object's frame.
    pub fn new(stops: &[Pose], object_from_stand: &[Pose]) -> WalkedWay {
        let stretch = |ends: &[Pose]| {
            let mut stretch = Stretch { from: ends[0], to: ends[1], length_m: 0.0 };
            let walked_m = |stand: &Pose| -> f32 {
                let place_m = |piece: usize| (stretch.at(piece as f32 / PIECES as f32) * *stand).translation;
                (0..PIECES).map(|piece| (place_m(piece + 1) - place_m(piece)).length()).sum()
            };
            stretch.length_m = object_from_stand.iter().map(walked_m).fold(0.0, f32::max);
            stretch
        };
        WalkedWay { stretches: stops.windows(2).map(stretch).collect() }
    }

    /// Returns the distance of the robot that has farthest to walk.
    pub fn length_m(&self) -> f32 {
        self.stretches.iter().map(|stretch| stretch.length_m).sum()
    }

    /// Returns the object's pose after `gone_m`.
    pub fn at(&self, gone_m: f32) -> Pose {
        let mut left_m = gone_m;
        for stretch in &self.stretches {
            if left_m < stretch.length_m {
                return stretch.at(left_m / stretch.length_m);
            }
            left_m -= stretch.length_m;
        }
        self.stretches.last().expect("a way has two stops").to
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::FRAC_PI_2;

    use tandem_sim::{Vector, heading_rad};

    use super::*;
    use crate::players::experts::skills::place;

    /// Robots are 1 m ahead of the object's middle and 0.5 m behind it. The object turns by a quarter, and
    /// then goes 2 m ahead.
    #[test]
    fn a_way_is_as_long_as_that_of_the_robot_with_farthest_to_go() {
        let ahead_m = |x_m: f32| place(Vector::X * x_m, 0.0);
        let turned = place(Vector::ZERO, FRAC_PI_2);
        let gone = place(Vector::Y * 2.0, FRAC_PI_2);
        let way = WalkedWay::new(&[ahead_m(0.0), turned, gone], &[ahead_m(1.0), ahead_m(-0.5)]);

        assert!((way.length_m() - (FRAC_PI_2 + 2.0)).abs() < 0.002, "{}", way.length_m());
        let half_turned = way.at((way.length_m() - 2.0) / 2.0);
        assert!((heading_rad(&half_turned) - FRAC_PI_2 / 2.0).abs() < 1e-3);
        assert!((way.at(way.length_m() - 0.5).translation - Vector::Y * 1.5).length() < 1e-3);
        assert!((way.at(way.length_m() + 1.0).translation - gone.translation).length() < 1e-3);
    }
}
