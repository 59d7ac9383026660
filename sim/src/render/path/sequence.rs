//! Random numbers for a pixel's samples. They depend on the pixel alone, so an image is the same on any
//! number of threads. The numbers of neighbouring pixels complement each other, so that the filter averages
//! them well.

/// Side of a tile of pixels whose samples together cover the unit square evenly; a power of two.
const TILE_PX: u32 = 8;

/// Total number of samples of a pixel; a power of two, so that they are evenly spread.
#[derive(Clone, Copy)]
pub struct SampleCount(pub u32);

/// Position of a pixel: its tile, and its index in the tile.
#[derive(Clone, Copy)]
pub struct PixelSeed {
    tile: u32,
    number: u32,
}

impl PixelSeed {
    pub fn of([column, row]: [u32; 2]) -> PixelSeed {
        PixelSeed {
            tile: hashed(hashed(column / TILE_PX) ^ (row / TILE_PX)),
            number: interleaved(column % TILE_PX) | interleaved(row % TILE_PX) << 1,
        }
    }

    /// Returns a point of the unit square for one of `count` samples. The samples of a tile, of a pixel and
    /// of a square of four pixels are each stratified: they are points of Sobol's (0, 2)-sequence. Each
    /// `purpose` has the same numbers, apart from a shift, so a path may use a purpose only once.
    pub fn spread(self, purpose: u32, sample: u32, SampleCount(count): SampleCount) -> [f32; 2] {
        let index = self.number * count + sample;
        let shift = hashed(self.tile ^ hashed(purpose));
        [fraction(index.reverse_bits() ^ shift), fraction(second_sobol(index) ^ hashed(shift))]
    }

    /// Returns independent numbers for one of the pixel's samples.
    pub fn independent(self, purpose: u32, sample: u32) -> IndependentNumbers {
        IndependentNumbers(hashed(hashed(self.tile ^ hashed(self.number ^ (purpose << 8))) ^ sample))
    }
}

/// O'Neill's PCG-RXS-M-XS generator with 32 bits.
pub struct IndependentNumbers(u32);

impl IndependentNumbers {
    pub fn uniform(&mut self) -> f32 {
        self.0 = self.0.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        fraction(mixed(self.0))
    }

    pub fn pair(&mut self) -> [f32; 2] {
        [self.uniform(), self.uniform()]
    }
}

/// Returns the number's hash, by one step of the generator.
fn hashed(number: u32) -> u32 {
    mixed(number.wrapping_mul(747_796_405).wrapping_add(2_891_336_453))
}

fn mixed(state: u32) -> u32 {
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// Returns a number in 0..1 from its 24 highest bits, which an f32 can hold.
fn fraction(bits: u32) -> f32 {
    (bits >> 8) as f32 / (1u32 << 24) as f32
}

/// Spreads the three lowest bits to every other place.
fn interleaved(number: u32) -> u32 {
    (number & 1) | (number & 2) << 1 | (number & 4) << 2
}

/// Returns the second coordinate of a point of Sobol's sequence, as a binary fraction.
fn second_sobol(mut index: u32) -> u32 {
    let (mut sum, mut direction) = (0, 1u32 << 31);
    while index != 0 {
        if index & 1 == 1 {
            sum ^= direction;
        }
        index >>= 1;
        direction ^= direction >> 1;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Counts the points in each of `columns` x `rows` equal rectangles.
    fn counts(points: &[[f32; 2]], columns: usize, rows: usize) -> Vec<usize> {
        let mut counts = vec![0; columns * rows];
        for [u, v] in points {
            counts[(v * rows as f32) as usize * columns + (u * columns as f32) as usize] += 1;
        }
        counts
    }

    #[test]
    fn samples_of_a_tile_and_of_a_pixel_cover_the_square_evenly() {
        let count = SampleCount(4);
        let of =
            |column, row| (0..4).map(move |sample| PixelSeed::of([column, row]).spread(7, sample, count));
        let tile: Vec<[f32; 2]> =
            (24..32).flat_map(|column| (40..48).flat_map(move |row| of(column, row))).collect();
        for (columns, rows) in [(16, 16), (256, 1), (1, 256), (64, 4)] {
            assert!(counts(&tile, columns, rows).iter().all(|count| *count == 1), "{columns} x {rows}");
        }
        let pixel: Vec<[f32; 2]> = of(25, 41).collect();
        assert_eq!(counts(&pixel, 2, 2), [1; 4]);
    }

    #[test]
    fn independent_numbers_have_the_mean_of_uniform_ones_and_differ() {
        let mut of_pixel = PixelSeed::of([3, 5]).independent(1, 0);
        let mut of_neighbour = PixelSeed::of([4, 5]).independent(1, 0);
        let (mut sum, mut equal) = (0.0, 0);
        for _ in 0..10_000 {
            let (one, other) = (of_pixel.uniform(), of_neighbour.uniform());
            sum += f64::from(one);
            equal += u32::from(one == other);
        }
        assert!((sum / 10_000.0 - 0.5).abs() < 0.02, "{sum}");
        assert!(equal < 5, "{equal}");
    }
}
