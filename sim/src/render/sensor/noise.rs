//! Normally distributed noise for every pixel, independent of the order in which pixels are visited.

use std::sync::LazyLock;

const BITS: u32 = 12;
const COUNT: usize = 1 << BITS;

/// Equiprobable quantiles of the standard normal distribution.
static QUANTILES: LazyLock<Vec<f32>> =
    LazyLock::new(|| (0..COUNT).map(|i| quantile((i as f64 + 0.5) / COUNT as f64) as f32).collect());

/// Noise of one image, pixel by pixel.
pub struct PixelNoise {
    seed: u64,
    quantile_values: &'static [f32],
}

impl PixelNoise {
    /// Creates the noise of a seed; different streams are independent.
    pub fn new(seed: u64, stream: u64) -> PixelNoise {
        PixelNoise { seed: mixed(seed ^ mixed(stream)), quantile_values: &QUANTILES }
    }

    /// Draws three numbers for a pixel, each with mean 0 and standard deviation 1.
    #[inline(always)]
    pub fn three(&self, pixel: usize) -> [f32; 3] {
        let bits = mixed(self.seed.wrapping_add((pixel as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        [52, 40, 28].map(|shift| self.quantile_values[(bits >> shift) as usize % COUNT])
    }

    /// Draws one number for a pixel.
    #[inline(always)]
    pub fn one(&self, pixel: usize) -> f32 {
        self.three(pixel)[0]
    }
}

/// Mixes the bits of a number: the last step of SplitMix64.
pub fn mixed(mut z: u64) -> u64 {
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// Returns the quantile of the standard normal distribution at `share`, with an error below 4.5e-4. Source:
/// Abramowitz and Stegun 26.2.23.
fn quantile(share: f64) -> f64 {
    let (tail, sign) = if share < 0.5 { (share, -1.0) } else { (1.0 - share, 1.0) };
    let t = (-2.0 * tail.ln()).sqrt();
    let above = 2.515_517 + t * (0.802_853 + t * 0.010_328);
    let below = 1.0 + t * (1.432_788 + t * (0.189_269 + t * 0.001_308));
    sign * (t - above / below)
}
