//! A picture's numbers, row by row, in blocks that are worked on at once.

/// As many as the widest registers in common use hold.
pub const LANES: usize = 8;

/// A block of numbers, or a smaller one.
pub type Lanes<const N: usize = LANES> = [f32; N];

/// Numbers of a block. A loop, for compilers make few instructions of it.
#[inline(always)]
pub fn lanes<const N: usize>(each: impl Fn(usize) -> f32) -> Lanes<N> {
    let mut numbers = [0.0; N];
    for (i, number) in numbers.iter_mut().enumerate() {
        *number = each(i);
    }
    numbers
}

/// Three of something, by their axes.
#[inline(always)]
pub fn axes<T>(each: impl Fn(usize) -> T) -> [T; 3] {
    [each(0), each(1), each(2)]
}

/// Samples in rows and columns, whose first are half a pitch from the picture's corner.
#[derive(Clone, Copy, Default)]
pub struct Grid {
    pub width: usize,
    pub height: usize,
    /// Between neighbours, in the unit that triangles are given in.
    pub pitch_px: f64,
}

impl Grid {
    /// From a row to the next: rows consist of whole blocks, the last of which may reach beyond the picture.
    pub fn stride(self) -> usize {
        self.width.next_multiple_of(LANES)
    }
}

/// A number for each sample of a grid.
#[derive(Default)]
pub struct SampleRows<T> {
    grid: Grid,
    numbers: Vec<T>,
}

impl<T: Copy> SampleRows<T> {
    /// Makes every number `value`.
    pub fn reset(&mut self, grid: Grid, value: T) {
        self.grid = grid;
        self.numbers.clear();
        self.numbers.resize(grid.stride() * grid.height, value);
    }

    pub fn row(&self, row: usize) -> &[T] {
        let start = row * self.grid.stride();
        &self.numbers[start..start + self.grid.width]
    }

    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        let start = row * self.grid.stride();
        &mut self.numbers[start..start + self.grid.width]
    }

    /// Makes every number what it is there.
    pub fn copy(&mut self, other: &SampleRows<T>) {
        self.grid = other.grid;
        self.numbers.clone_from(&other.numbers);
    }

    /// All of them, row by row.
    pub fn all_mut(&mut self) -> &mut [T] {
        &mut self.numbers
    }
}
