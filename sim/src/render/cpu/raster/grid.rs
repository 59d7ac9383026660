//! A number for each sample of a picture.

use crate::render::shading::lanes::LANES;

/// Samples in rows and columns, whose first are half a pitch from the picture's corner.
#[derive(Clone, Copy, Default)]
pub struct Grid {
    pub width: usize,
    pub height: usize,
    /// Distance between neighbours, in the unit that triangles are given in.
    pub pitch_px: f64,
}

impl Grid {
    /// Distance from a row to the next: rows consist of whole blocks, the last of which may reach beyond the picture. Were it a whole
    /// number of kilobytes, the samples of a column would all want the same few places of a processor's cache.
    pub fn stride(self) -> usize {
        const KILOBYTE: usize = 1024 / size_of::<f32>();
        let stride = self.width.next_multiple_of(LANES);
        if stride.is_multiple_of(KILOBYTE) { stride + 2 * LANES } else { stride }
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

    /// Makes room for a number at each sample. What it is stays open: `value`, or something of an earlier grid.
    pub fn fit(&mut self, grid: Grid, value: T) {
        self.grid = grid;
        self.numbers.resize(grid.stride() * grid.height, value);
    }

    #[inline(always)]
    pub fn row(&self, row: usize) -> &[T] {
        let start = row * self.grid.stride();
        &self.numbers[start..start + self.grid.width]
    }

    /// What begins at a sample and at those below it; the rows go on to the next ones.
    #[inline(always)]
    pub fn rows_from(&self, row: usize, column: usize) -> impl Iterator<Item = &[T]> {
        let stride = self.grid.stride();
        self.numbers[row * stride + column..].chunks(stride)
    }

    #[inline(always)]
    pub fn row_mut(&mut self, row: usize) -> &mut [T] {
        let start = row * self.grid.stride();
        &mut self.numbers[start..start + self.grid.width]
    }

    /// Copies every number of another grid.
    pub fn copy(&mut self, other: &SampleRows<T>) {
        self.grid = other.grid;
        self.numbers.clone_from(&other.numbers);
    }

    /// All of them, row by row.
    pub fn all_mut(&mut self) -> &mut [T] {
        &mut self.numbers
    }
}
