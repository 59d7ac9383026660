//! A number for each sample of an image.

use crate::render::shading::lanes::LANES;

/// Samples in rows and columns, the first of which are half a pitch from the image's corner.
#[derive(Clone, Copy, Default)]
pub struct Grid {
    pub width: usize,
    pub height: usize,
    /// Distance between neighbours, in the unit of the triangles.
    pub pitch_px: f64,
}

impl Grid {
    /// Returns the distance from a row to the next: rows consist of whole blocks, the last of which may
    /// extend beyond the image. A multiple of a kilobyte is avoided, since the samples of a column would
    /// then compete for the same few cache sets.
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
    /// Sets every number to `value`.
    pub fn reset(&mut self, grid: Grid, value: T) {
        self.grid = grid;
        self.numbers.clear();
        self.numbers.resize(grid.stride() * grid.height, value);
    }

    /// Allocates a number for each sample. Its content is unspecified: `value`, or a number of an
    /// earlier grid.
    pub fn fit(&mut self, grid: Grid, value: T) {
        self.grid = grid;
        self.numbers.resize(grid.stride() * grid.height, value);
    }

    #[inline(always)]
    pub fn row(&self, row: usize) -> &[T] {
        let start = row * self.grid.stride();
        &self.numbers[start..start + self.grid.width]
    }

    /// Returns slices that begin at a sample and at the samples below it. Each is one stride long and may
    /// extend into the next row.
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

    /// Returns all numbers, row by row.
    pub fn all(&self) -> &[T] {
        &self.numbers
    }

    /// Returns all numbers, row by row.
    pub fn all_mut(&mut self) -> &mut [T] {
        &mut self.numbers
    }
}
