//! Randomisation by seed: offsets drawn uniformly, in table order, from a generator that is the same on
//! every platform.

use std::ops::RangeInclusive;

use serde::{Deserialize, Serialize};
use tandem_sim::SplitMix64;

use super::{ObjectSpot, TaskDefinition};

/// A displacement shared by several objects: uniform along each world axis and about the vertical.
#[derive(Clone, Debug)]
pub struct Offset {
    /// Objects that move together.
    pub objects: Vec<String>,
    pub x_m: RangeInclusive<f32>,
    pub y_m: RangeInclusive<f32>,
    pub z_m: RangeInclusive<f32>,
    /// Rotation about the vertical axis through the first object.
    pub yaw_rad: RangeInclusive<f32>,
    /// Additional yaw in either direction at a spread of 2; a spread of 4 adds three times as much.
    pub wider_yaw_rad: f32,
    /// True for objects on a wall across y. A wider spread does not widen their y range, which would move
    /// them into the wall or off it.
    pub on_wall: bool,
}

/// Width of the randomisation, as a multiple of the benchmark's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(try_from = "u8", into = "u8")]
pub enum Spread {
    /// The benchmark's own randomisation.
    #[default]
    Single,
    Double,
    Triple,
    Quadruple,
}

impl Spread {
    pub const ALL: [Spread; 4] = [Spread::Single, Spread::Double, Spread::Triple, Spread::Quadruple];

    /// Returns the multiple.
    pub fn times(self) -> u8 {
        match self {
            Spread::Single => 1,
            Spread::Double => 2,
            Spread::Triple => 3,
            Spread::Quadruple => 4,
        }
    }

    pub fn name(self) -> &'static str {
        match self {
            Spread::Single => "1",
            Spread::Double => "2",
            Spread::Triple => "3",
            Spread::Quadruple => "4",
        }
    }
}

impl From<Spread> for u8 {
    fn from(spread: Spread) -> u8 {
        spread.times()
    }
}

impl TryFrom<u8> for Spread {
    type Error = String;

    fn try_from(times: u8) -> Result<Spread, String> {
        Spread::ALL
            .into_iter()
            .find(|spread| spread.times() == times)
            .ok_or_else(|| format!("no spread {times}; have: {}", Spread::ALL.map(Spread::name).join(", ")))
    }
}

impl Offset {
    /// Returns the ranges of x, y, z and yaw. A wider spread widens them about their middles.
    pub fn ranges(&self, spread: Spread) -> [[f32; 2]; 4] {
        let [x_m, y_m, z_m, yaw_rad] = [&self.x_m, &self.y_m, &self.z_m, &self.yaw_rad];
        let own = [x_m, y_m, z_m, yaw_rad].map(|range| [*range.start(), *range.end()]);
        if spread == Spread::Single {
            // Returned unchanged, to the last bit.
            return own;
        }
        let times = f32::from(spread.times());
        let wider = |[low, high]: [f32; 2]| {
            let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * times);
            [middle - half, middle + half]
        };
        let [x_m, y_m, z_m, yaw_rad] = own;
        let y_m = if self.on_wall { y_m } else { wider(y_m) };
        let [x_m, z_m, [least_rad, most_rad]] = [x_m, z_m, yaw_rad].map(wider);
        let turn_rad = self.wider_yaw_rad * (times - 1.0);
        [x_m, y_m, z_m, [least_rad - turn_rad, most_rad + turn_rad]]
    }
}

impl TaskDefinition {
    /// Returns the start pose of every object for a seed, in the order of the field `objects`.
    pub fn start_poses(&self, seed: u32, spread: Spread) -> Vec<StartPose> {
        let mut random = SplitMix64(seed.into());
        let mut start_poses: Vec<StartPose> = self
            .objects
            .iter()
            .map(|spot| StartPose { position_m: spot.position_m, yaw_rad: spot.yaw_rad })
            .collect();
        for offset in &self.randomize {
            let [x_m, y_m, z_m, yaw_rad] = offset.ranges(spread).map(|range| random.uniform(range));
            let moved = |spot: &ObjectSpot| offset.objects.contains(&spot.name);
            let first = self.objects.iter().position(|spot| offset.objects.first() == Some(&spot.name));
            let centre_m = first.map(|first| start_poses[first].position_m).unwrap_or_default();
            for (start, _) in start_poses.iter_mut().zip(&self.objects).filter(|(_, spot)| moved(spot)) {
                start.position_m = turned(start.position_m, centre_m, yaw_rad);
                start.position_m =
                    [start.position_m[0] + x_m, start.position_m[1] + y_m, start.position_m[2] + z_m];
                start.yaw_rad += yaw_rad;
            }
        }
        start_poses
    }
}

/// Rotates a point about the vertical axis through another point. A point on the axis is returned unchanged.
fn turned(point_m: [f32; 3], centre_m: [f32; 3], yaw_rad: f32) -> [f32; 3] {
    let [x_m, y_m] = [point_m[0] - centre_m[0], point_m[1] - centre_m[1]];
    if yaw_rad == 0.0 || (x_m == 0.0 && y_m == 0.0) {
        return point_m;
    }
    let (sine, cosine) = yaw_rad.sin_cos();
    let [east_m, north_m] = [cosine * x_m - sine * y_m, sine * x_m + cosine * y_m];
    [centre_m[0] + east_m, centre_m[1] + north_m, point_m[2]]
}

/// Start pose of an object: world position, and yaw.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StartPose {
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
}

/// Tests of seeds and ranges.
#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks::cohub;

    #[test]
    fn offsets_fill_their_ranges_and_stay_inside() {
        for task in cohub() {
            let start_poses: Vec<_> = (0..400).map(|seed| task.start_poses(seed, Spread::Single)).collect();
            for (index, spot) in task.objects.iter().enumerate() {
                let own: Vec<_> =
                    task.randomize.iter().filter(|offset| offset.objects.contains(&spot.name)).collect();
                let axes: [fn(&Offset) -> &RangeInclusive<f32>; 4] =
                    [|o| &o.x_m, |o| &o.y_m, |o| &o.z_m, |o| &o.yaw_rad];
                let rest = [spot.position_m[0], spot.position_m[1], spot.position_m[2], spot.yaw_rad];
                for (axis, range) in axes.into_iter().enumerate() {
                    let low: f32 = own.iter().map(|offset| *range(offset).start()).sum();
                    let high: f32 = own.iter().map(|offset| *range(offset).end()).sum();
                    let value = |start: &StartPose| {
                        [start.position_m[0], start.position_m[1], start.position_m[2], start.yaw_rad][axis]
                    };
                    let moved = start_poses.iter().map(|start| value(&start[index]) - rest[axis]);
                    let (least, most) = moved.fold((f32::MAX, f32::MIN), |(l, h), m| (l.min(m), h.max(m)));
                    // Sums of several offsets seldom reach the ends of their ranges.
                    let (slack, width) = (1e-5, high - low);
                    assert!(
                        least >= low - slack && least <= low + 0.25 * width + slack,
                        "{} {axis}",
                        spot.name
                    );
                    assert!(
                        most <= high + slack && most >= high - 0.25 * width - slack,
                        "{} {axis}",
                        spot.name
                    );
                }
            }
        }
    }

    #[test]
    fn a_seed_always_means_the_same_start_and_seeds_differ() {
        for task in cohub() {
            for spread in Spread::ALL {
                assert_eq!(task.start_poses(7, spread), task.start_poses(7, spread));
                assert_ne!(task.start_poses(7, spread), task.start_poses(8, spread));
            }
        }
    }

    /// Poses before spreads were introduced: each offset's four numbers drawn and added.
    #[test]
    fn a_spread_of_one_is_what_the_benchmark_has_bit_for_bit() {
        for task in cohub() {
            for seed in [0, 7, 2000, u32::MAX] {
                let mut random = SplitMix64(seed.into());
                let mut expected: Vec<[f32; 4]> = task
                    .objects
                    .iter()
                    .map(|spot| [spot.position_m[0], spot.position_m[1], spot.position_m[2], spot.yaw_rad])
                    .collect();
                for offset in &task.randomize {
                    let drawn = [&offset.x_m, &offset.y_m, &offset.z_m, &offset.yaw_rad]
                        .map(|range| random.uniform([*range.start(), *range.end()]));
                    for (place, spot) in expected.iter_mut().zip(&task.objects) {
                        if offset.objects.contains(&spot.name) {
                            *place = std::array::from_fn(|axis| place[axis] + drawn[axis]);
                        }
                    }
                }
                let places = task.start_poses(seed, Spread::Single).into_iter().map(|start| {
                    let [x_m, y_m, z_m] = start.position_m;
                    [x_m, y_m, z_m, start.yaw_rad].map(f32::to_bits)
                });
                let expected = expected.into_iter().map(|place| place.map(f32::to_bits));
                assert!(places.eq(expected), "{} seed {seed}", task.id);
            }
        }
    }

    #[test]
    fn a_wider_spread_fills_wider_ranges_and_turns_what_goes_together_as_one() {
        for task in cohub() {
            let farthest = |spread: Spread| {
                let places = (0..400).flat_map(|seed| task.start_poses(seed, spread));
                let moved = places.zip(task.objects.iter().cycle()).map(|(start, spot)| {
                    f32::hypot(
                        start.position_m[0] - spot.position_m[0],
                        start.position_m[1] - spot.position_m[1],
                    )
                });
                moved.fold(0.0, f32::max)
            };
            let [one, two, three, four] = Spread::ALL.map(farthest);
            assert!(two > 1.3 * one && four > 1.3 * two, "{}: {one} {two} {four}", task.id);
            assert!(three > two && four > three, "{}: {two} {three} {four}", task.id);
            let turned = |start: &StartPose, spot: &ObjectSpot| start.yaw_rad != spot.yaw_rad;
            let any = task.start_poses(7, Spread::Double);
            assert!(any.iter().zip(&task.objects).any(|(start, spot)| turned(start, spot)), "{}", task.id);
        }
        // The bottle keeps its place on the trolley's tray.
        let task = crate::tasks::find("cart_service").unwrap();
        let [trolley, bottle] = [0, 1].map(|index| task.objects[index].position_m);
        let apart_m = bottle[1] - trolley[1];
        let start = task.start_poses(2000, Spread::Quadruple);
        let [trolley, bottle] = [0, 1].map(|index| start[index]);
        let (sine, cosine) = trolley.yaw_rad.sin_cos();
        let expected_m = [trolley.position_m[0] - sine * apart_m, trolley.position_m[1] + cosine * apart_m];
        let off_m = f32::hypot(bottle.position_m[0] - expected_m[0], bottle.position_m[1] - expected_m[1]);
        assert!(off_m < 1e-5 && trolley.yaw_rad != 0.0, "{start:?}");
    }
}
