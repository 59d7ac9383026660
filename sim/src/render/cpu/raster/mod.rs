//! Rasteriser: finds the samples of an image that are inside a triangle, row by row, and its nearness there.

mod batch;
mod grid;
mod large;
mod rays;
mod small;

pub use batch::TriangleBatch;
pub use grid::{Grid, SampleRows};
pub use rays::Rays;

use pulp::Simd;

use crate::render::shading::lanes::{LANES, Lanes, lanes};
use small::{SMALL_BLOCKS, SMALL_ROWS};

/// A batch of projected triangles.
///
/// Their planes, and the edges of large triangles, are f64. A floor triangle clipped at the near plane has
/// corners 1e4 pixels off the image, and f32 gradients would err by centimetres. In f64, two triangles also
/// have bit-identical common edges, which leave no gap.
pub struct Outlines {
    count: usize,
    corners: [[Lanes; 3]; 3],
    tags: [u32; LANES],
    /// Image coordinates of the corners.
    places: [[Wide; 2]; 3],
    /// Nearness at the first corner, and its derivatives.
    nearness_value: Wide,
    x_factor: Wide,
    y_factor: Wide,
    /// True if the camera sees the corners counter-clockwise.
    front: [bool; LANES],
}

type Wide = [f64; LANES];

/// Ranges of samples of a grid that triangles can reach, with inclusive ends.
struct Reaches {
    some: [bool; LANES],
    x0: [u32; LANES],
    x1: [u32; LANES],
    y0: [u32; LANES],
    y1: [u32; LANES],
}

/// Range of samples of a grid that a triangle can reach, with inclusive ends.
#[derive(Clone, Copy)]
struct Reach {
    x0: u32,
    x1: u32,
    y0: u32,
    y1: u32,
}

/// Start and end corners of the edges.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl Outlines {
    /// Calls `each` for all vectors of samples that front faces reach. Its arguments are the vector's number
    /// in the grid, the triangle's tag and the nearness of the samples, which is 0 outside of the triangle.
    #[inline(always)]
    pub fn draw<S: Simd>(&self, simd: S, grid: Grid, mut each: impl FnMut(usize, u32, S::f32s)) {
        let reaches = self.reaches(grid);
        let slopes = self.slopes(grid, &reaches);
        for i in 0..self.count.min(LANES) {
            if !(self.front[i] && reaches.some[i]) {
                continue;
            }
            let reach = Reach { x0: reaches.x0[i], x1: reaches.x1[i], y0: reaches.y0[i], y1: reaches.y1[i] };
            if reach.blocks() <= SMALL_BLOCKS && reach.y1 - reach.y0 < SMALL_ROWS {
                slopes.draw(simd, grid, reach, (i, self.tags[i]), &mut each);
            } else {
                self.draw_large(simd, grid, reach, i, &mut each);
            }
        }
    }

    /// Computes the reached samples. This is exact in f32: if halves are lost, a coordinate is outside
    /// of the image.
    #[inline(always)]
    fn reaches(&self, grid: Grid) -> Reaches {
        let per_pitch = (1.0 / grid.pitch_px) as f32;
        let first = |axis: usize| -> Lanes {
            let [a, b, c] = self.corners.each_ref().map(|corner| &corner[axis]);
            lanes(|i| larger(smaller(smaller(a[i], b[i]), c[i]) * per_pitch - 0.5, 0.0).ceil())
        };
        let last = |axis: usize, count: usize| -> Lanes {
            let [a, b, c] = self.corners.each_ref().map(|corner| &corner[axis]);
            let end = (count - 1) as f32;
            lanes(|i| smaller(larger(larger(a[i], b[i]), c[i]) * per_pitch - 0.5, end).floor())
        };
        let (x0, x1, y0, y1) = (first(0), last(0, grid.width), first(1), last(1, grid.height));
        let some = lanes(|i| x0[i] <= x1[i] && y0[i] <= y1[i]);
        let [x0, x1, y0, y1] = [x0, x1, y0, y1].map(|values| lanes(|i| whole_f32(values[i])));
        Reaches { some, x0, x1, y0, y1 }
    }
}

impl Reach {
    /// Returns the number of blocks that the range spans in each row.
    #[inline(always)]
    fn blocks(self) -> usize {
        self.x1 as usize / LANES - self.x0 as usize / LANES + 1
    }
}

#[inline(always)]
fn wide(values: &Lanes) -> Wide {
    lanes(|i| f64::from(values[i]))
}

/// Returns the larger value, without the NaN handling of `max` (and `min`, below).
#[inline(always)]
pub fn larger<T: PartialOrd>(value: T, min: T) -> T {
    if value > min { value } else { min }
}

#[inline(always)]
pub fn smaller<T: PartialOrd>(value: T, max: T) -> T {
    if value < max { value } else { max }
}

/// Converts a number that is whole, not negative and below 8 million. It becomes the lowest bits of the
/// sum; a cast would process each number separately.
#[inline(always)]
pub fn whole_f32(value: f32) -> u32 {
    const ALL_BITS_WHOLE: f32 = (1u32 << 23) as f32;
    (value + ALL_BITS_WHOLE).to_bits() & ((1 << 23) - 1)
}
