//! What the seed changes: offsets drawn uniformly, in table order, from a generator that is the same everywhere.

use std::ops::RangeInclusive;

use super::Task;

/// A displacement that some objects share, uniform on each axis of the world and about it.
#[derive(Debug)]
pub struct Offset {
    /// Objects that move together.
    pub objects: &'static [&'static str],
    pub x_m: RangeInclusive<f32>,
    pub y_m: RangeInclusive<f32>,
    pub z_m: RangeInclusive<f32>,
    /// Turn about each object's own vertical axis.
    pub yaw_rad: RangeInclusive<f32>,
}

/// Up to `x_m` and `y_m` either way along world x and y, independently.
pub const fn uniform_xy(objects: &'static [&'static str], x_m: f32, y_m: f32) -> Offset {
    Offset { objects, x_m: -x_m..=x_m, y_m: -y_m..=y_m, z_m: 0.0..=0.0, yaw_rad: 0.0..=0.0 }
}

impl Task {
    /// Where every object starts under `seed`, in the order of [`Task::objects`]: world position in metres, and yaw.
    pub fn starts(&self, seed: u32) -> Vec<Start> {
        let mut random = SplitMix64(seed.into());
        let mut starts: Vec<Start> = self
            .objects
            .iter()
            .map(|spot| Start { position_m: spot.position_m, yaw_rad: spot.yaw_rad })
            .collect();
        for offset in self.randomize {
            let [x_m, y_m, z_m, yaw_rad] =
                [&offset.x_m, &offset.y_m, &offset.z_m, &offset.yaw_rad].map(|range| random.uniform(range));
            let moved = |spot: &super::ObjectSpot| offset.objects.contains(&spot.name);
            for (start, _) in starts.iter_mut().zip(self.objects).filter(|(_, spot)| moved(spot)) {
                start.position_m =
                    [start.position_m[0] + x_m, start.position_m[1] + y_m, start.position_m[2] + z_m];
                start.yaw_rad += yaw_rad;
            }
        }
        starts
    }
}

/// Where one object starts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Start {
    pub position_m: [f32; 3],
    pub yaw_rad: f32,
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

    /// Uniform over `values`, from the 24 highest bits, which is what an f32 holds.
    fn uniform(&mut self, values: &RangeInclusive<f32>) -> f32 {
        let unit = (self.next() >> 40) as f32 / (1u32 << 24) as f32;
        values.start() + unit * (values.end() - values.start())
    }
}

#[cfg(test)]
mod tests;
