//! Pseudo-random numbers that are the same everywhere.

use serde::{Deserialize, Serialize};

/// Steele, Lea and Flood's SplitMix64: ten lines, so that a seed has the same meaning in every version
/// of Tandem, independently of random number crates.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SplitMix64(pub u64);

impl SplitMix64 {
    /// Draws a uniform number between the two, from the 24 highest bits, which an f32 can hold.
    pub fn uniform(&mut self, [low, high]: [f32; 2]) -> f32 {
        low + (high - low) * ((self.next() >> 40) as f32 / (1u64 << 24) as f32)
    }

    /// Draws a normally distributed number with mean 0 and standard deviation 1, after Box and Muller.
    pub fn normal(&mut self) -> f32 {
        let [radius, angle] =
            [self.next(), self.next()].map(|bits| ((bits >> 40) as f32 + 0.5) / (1u64 << 24) as f32);
        (-2.0 * radius.ln()).sqrt() * (std::f32::consts::TAU * angle).cos()
    }

    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn generator_gives_the_published_numbers() {
        let mut random = SplitMix64(1234567);
        let published = [6457827717110365317, 3203168211198807973, 9817491932198370423];
        assert_eq!([random.next(), random.next(), random.next()], published);
    }
}
