//! What the seed changes: offsets drawn uniformly, in table order, from a generator that is the same everywhere.

use std::ops::RangeInclusive;

use super::Task;

/// An object's displacement from its spot, uniform on each axis of the world.
#[derive(Debug)]
pub struct Offset {
    pub object: &'static str,
    pub x_m: RangeInclusive<f32>,
    pub y_m: RangeInclusive<f32>,
}

/// Up to `half_m` either way along world x and y, independently.
pub const fn uniform_xy(object: &'static str, half_m: f32) -> Offset {
    Offset { object, x_m: -half_m..=half_m, y_m: -half_m..=half_m }
}

impl Task {
    /// Where every object starts under `seed`, in the order of [`Task::objects`]: world position in metres.
    pub fn object_positions_m(&self, seed: u32) -> Vec<[f32; 3]> {
        let mut random = SplitMix64(seed.into());
        let offsets: Vec<(&str, [f32; 2])> = self
            .randomize
            .iter()
            .map(|o| (o.object, [random.uniform(&o.x_m), random.uniform(&o.y_m)]))
            .collect();
        let start = |spot: &super::ObjectSpot| {
            let mut position_m = spot.position_m;
            for (_, [x_m, y_m]) in offsets.iter().filter(|(object, _)| *object == spot.name) {
                position_m[0] += x_m;
                position_m[1] += y_m;
            }
            position_m
        };
        self.objects.iter().map(start).collect()
    }
}

/// Steele, Lea and Flood's SplitMix64: ten lines, so that a seed means the same episode in every version of Tandem,
/// whatever becomes of random number crates.
struct SplitMix64(u64);

impl SplitMix64 {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Uniform over `range`, from the 24 highest bits, which is what an f32 holds.
    fn uniform(&mut self, range: &RangeInclusive<f32>) -> f32 {
        let unit = (self.next() >> 40) as f32 / (1u32 << 24) as f32;
        range.start() + unit * (range.end() - range.start())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tasks::ALL;

    #[test]
    fn generator_gives_the_published_numbers() {
        let mut random = SplitMix64(1234567);
        let published = [6457827717110365317, 3203168211198807973, 9817491932198370423];
        assert_eq!([random.next(), random.next(), random.next()], published);
    }

    #[test]
    fn offsets_fill_their_ranges_and_stay_inside() {
        for task in ALL {
            let starts: Vec<_> = (0..400).map(|seed| task.object_positions_m(seed)).collect();
            for (index, spot) in task.objects.iter().enumerate() {
                let Some(offset) = task.randomize.iter().find(|o| o.object == spot.name) else {
                    continue;
                };
                for (axis, range) in [&offset.x_m, &offset.y_m].into_iter().enumerate() {
                    let moved = starts.iter().map(|start| start[index][axis] - spot.position_m[axis]);
                    let (low, high) = moved.fold((f32::MAX, f32::MIN), |(l, h), m| (l.min(m), h.max(m)));
                    let (slack, width) = (1e-6, range.end() - range.start());
                    assert!(low >= range.start() - slack && low < range.start() + 0.05 * width);
                    assert!(high <= range.end() + slack && high > range.end() - 0.05 * width);
                }
                assert!(starts.iter().all(|start| start[index][2] == spot.position_m[2]));
            }
        }
    }

    #[test]
    fn a_seed_always_means_the_same_start_and_seeds_differ() {
        for task in ALL {
            assert_eq!(task.object_positions_m(7), task.object_positions_m(7));
            assert_ne!(task.object_positions_m(7), task.object_positions_m(8));
        }
    }
}
