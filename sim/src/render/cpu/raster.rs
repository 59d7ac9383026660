//! Rasteriser: the samples of a picture, row by row; which of them lie in a triangle, and how near it is there.

use pulp::Simd;

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
    /// Distance from a row to the next: rows consist of whole blocks, the last of which may reach beyond the picture.
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

/// The picture of a triangle that faces the camera.
///
/// Its plane and the edges of large ones are f64: a floor triangle clipped at the near plane has corners 1e4 pixels off the
/// picture, and f32 gradients would err by centimetres. In f64 the edge that two triangles share also comes out
/// the same for both, to the bit, and leaves no gap.
pub struct ProjectedTriangle {
    /// Picture coordinates.
    corners: [[f64; 2]; 3],
    /// Nearness at the first corner, and how it changes.
    nearness_value: f64,
    x_factor: f64,
    y_factor: f64,
}

/// The samples of a grid that a triangle can reach, the last ones included.
#[derive(Clone, Copy)]
struct Reach {
    x0: u32,
    x1: u32,
    y0: u32,
    y1: u32,
}

/// Where a line crosses a height: `x = slope_ratio * y + offset_value`.
#[derive(Clone, Copy)]
struct Edge {
    slope_ratio: f64,
    offset_value: f64,
}

/// The samples of a triangle in one row of a grid: nearness at the first, and from each to the next.
#[derive(Clone, Copy)]
struct Span {
    row: usize,
    first: u32,
    end: u32,
    start_value: f32,
    step_value: f32,
}

/// Rows of a large triangle that are measured at once.
const ROWS: usize = 4;
/// A triangle is small if it is no higher, and reaches into no more than two blocks of each row.
const SMALL_ROWS: u32 = 16;
/// A small triangle is drawn this far beyond its edges, in parts of their lengths: f32 then leaves no gaps.
const OVERLAP: f32 = 1e-5;
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl ProjectedTriangle {
    /// Corners are picture coordinates and nearness, counter-clockwise as the camera sees them; `None` for a back face.
    #[inline(always)]
    pub fn new(corners: [[f32; 3]; 3]) -> Option<ProjectedTriangle> {
        let wide = |corner: usize, axis: usize| f64::from(corners[corner][axis]);
        let (ax, ay, an) = (wide(0, 0), wide(0, 1), wide(0, 2));
        let (bx, by, bn) = (wide(1, 0), wide(1, 1), wide(1, 2));
        let (cx, cy, cn) = (wide(2, 0), wide(2, 1), wide(2, 2));
        let (ux, uy, un, vx, vy, vn) = (bx - ax, by - ay, bn - an, cx - ax, cy - ay, cn - an);
        // Rows count downwards, so that what is counter-clockwise has a negative area.
        let area = ux * vy - uy * vx;
        if area >= 0.0 || !area.is_finite() {
            return None;
        }
        let per_area = 1.0 / area;
        Some(ProjectedTriangle {
            corners: [[ax, ay], [bx, by], [cx, cy]],
            nearness_value: an,
            x_factor: (un * vy - vn * uy) * per_area,
            y_factor: (vn * ux - un * vx) * per_area,
        })
    }

    /// Calls `each` for all vectors of samples that the triangle reaches into, with their number in the grid and the nearness
    /// of their samples: 0 for those outside of it.
    #[inline(always)]
    pub fn draw<S: Simd>(&self, simd: S, grid: Grid, each: impl FnMut(usize, S::f32s)) {
        let Some(reach) = self.reach(grid) else { return };
        let blocks = reach.x1 / LANES as u32 - reach.x0 / LANES as u32;
        if blocks <= 1 && reach.y1 - reach.y0 < SMALL_ROWS {
            self.draw_small(simd, grid, reach, each);
        } else {
            self.draw_large(simd, grid, reach, each);
        }
    }

    #[inline(always)]
    fn reach(&self, grid: Grid) -> Option<Reach> {
        let [[ax, ay], [bx, by], [cx, cy]] = self.corners;
        let per_pitch = 1.0 / grid.pitch_px;
        let first = |low: f64| larger(low * per_pitch - 0.5, 0.0).ceil();
        let last = |high: f64, count: usize| smaller(high * per_pitch - 0.5, (count - 1) as f64).floor();
        let x0 = first(smaller(smaller(ax, bx), cx));
        let x1 = last(larger(larger(ax, bx), cx), grid.width);
        let y0 = first(smaller(smaller(ay, by), cy));
        let y1 = last(larger(larger(ay, by), cy), grid.height);
        let some = x0 <= x1 && y0 <= y1;
        some.then(|| Reach { x0: whole(x0), x1: whole(x1), y0: whole(y0), y1: whole(y1) })
    }

    /// Looks at each sample: an edge from p to q has those on its inner side where
    /// `(x - px) (qy - py) - (y - py) (qx - px) >= 0`.
    #[inline(always)]
    fn draw_small<S: Simd>(&self, simd: S, grid: Grid, reach: Reach, mut each: impl FnMut(usize, S::f32s)) {
        let lanes = S::F32_LANES;
        let (first, last) = (reach.x0 as usize / lanes, reach.x1 as usize / lanes);
        let y = (f64::from(reach.y0) + 0.5) * grid.pitch_px;
        let nothing = simd.splat_f32s(0.0);
        for vector in first..=last {
            let x = ((vector * lanes) as f64 + 0.5) * grid.pitch_px;
            // What changes from sample to sample, from row to row, and what it is at the first sample of the first row.
            let linear = |across: f32, start: f32| {
                let lane = S::as_simd_f32s(&LANE).0[0];
                simd.add_f32s(simd.splat_f32s(start), simd.mul_f32s(simd.splat_f32s(across), lane))
            };
            let pitch = grid.pitch_px as f32;
            let edge = |from: usize, to: usize| {
                let ([px, py], [qx, qy]) = (self.corners[from], self.corners[to]);
                let (right, down) = ((qx - px) as f32, (qy - py) as f32);
                let overlap = OVERLAP * (right.abs() + down.abs());
                let start = (x - px) as f32 * down - (y - py) as f32 * right + overlap;
                (linear(down * pitch, start), simd.splat_f32s(-right * pitch))
            };
            let edges = [edge(0, 1), edge(1, 2), edge(2, 0)];
            let [mut a, mut b, mut c] = edges.map(|(start, _)| start);
            let [down_a, down_b, down_c] = edges.map(|(_, down)| down);
            let [ax, ay] = self.corners[0];
            let start = self.nearness_value + self.x_factor * (x - ax) + self.y_factor * (y - ay);
            let mut nearness = linear((self.x_factor * grid.pitch_px) as f32, start as f32);
            let down = simd.splat_f32s((self.y_factor * grid.pitch_px) as f32);
            for row in reach.y0..=reach.y1 {
                let inside = simd.greater_than_or_equal_f32s(simd.min_f32s(a, simd.min_f32s(b, c)), nothing);
                let index = row as usize * (grid.stride() / lanes) + vector;
                each(index, simd.select_f32s(inside, nearness, nothing));
                (a, b, c) = (simd.add_f32s(a, down_a), simd.add_f32s(b, down_b), simd.add_f32s(c, down_c));
                nearness = simd.add_f32s(nearness, down);
            }
        }
    }

    /// Measures where each row begins and ends.
    #[inline(always)]
    fn draw_large<S: Simd>(&self, simd: S, grid: Grid, reach: Reach, mut each: impl FnMut(usize, S::f32s)) {
        let (left, right) = self.edges();
        let per_pitch = 1.0 / grid.pitch_px;
        let (x0, x1) = (f64::from(reach.x0), f64::from(reach.x1));
        let [ax, ay] = self.corners[0];
        for top in (reach.y0..=reach.y1).step_by(ROWS) {
            let (mut firsts, mut ends, mut starts) = ([0; ROWS], [0; ROWS], [0.0; ROWS]);
            for row in 0..ROWS {
                let y = (f64::from(top + row as u32) + 0.5) * grid.pitch_px;
                let x = |edge: Edge| (edge.slope_ratio * y + edge.offset_value) * per_pitch - 0.5;
                let first = smaller(larger(larger(x(left[0]), x(left[1])), x0).ceil(), x1 + 1.0);
                let end = larger(smaller(smaller(x(right[0]), x(right[1])), x1).floor() + 1.0, x0);
                let start = self.x_factor * ((first + 0.5) * grid.pitch_px - ax) + self.y_factor * (y - ay);
                (firsts[row], ends[row]) = (whole(first), whole(end));
                starts[row] = (self.nearness_value + start) as f32;
            }
            for row in 0..ROWS.min((reach.y1 - top + 1) as usize) {
                if firsts[row] < ends[row] {
                    let (first, end, start_value) = (firsts[row], ends[row], starts[row]);
                    let step_value = (self.x_factor * grid.pitch_px) as f32;
                    let span = Span { row: top as usize + row, first, end, start_value, step_value };
                    span.draw(simd, grid, &mut each);
                }
            }
        }
    }

    /// What is inside lies to the right of the first two, and to the left of the others.
    #[inline(always)]
    fn edges(&self) -> ([Edge; 2], [Edge; 2]) {
        let mut left = [Edge { slope_ratio: 0.0, offset_value: f64::NEG_INFINITY }; 2];
        let mut right = [Edge { slope_ratio: 0.0, offset_value: f64::INFINITY }; 2];
        let (mut lefts, mut rights) = (0, 0);
        for (from, to) in [(0, 1), (1, 2), (2, 0)] {
            let ([px, py], [qx, qy]) = (self.corners[from], self.corners[to]);
            // A level edge bounds no row.
            let down = qy - py;
            let per_down = 1.0 / down;
            let edge =
                Edge { slope_ratio: (qx - px) * per_down, offset_value: (px * qy - qx * py) * per_down };
            if down > 0.0 {
                left[lefts] = edge;
                lefts += 1;
            } else if down < 0.0 {
                right[rights] = edge;
                rights += 1;
            }
        }
        (left, right)
    }
}

impl Span {
    #[inline(always)]
    fn draw<S: Simd>(self, simd: S, grid: Grid, each: &mut impl FnMut(usize, S::f32s)) {
        let lanes = S::F32_LANES;
        let (first, last) = (self.first as usize / lanes, (self.end as usize - 1) / lanes);
        let nothing = simd.splat_f32s(0.0);
        let (start, step) = (simd.splat_f32s(self.start_value), simd.splat_f32s(self.step_value));
        let length = simd.splat_f32s((self.end - self.first) as f32);
        let before = simd.splat_f32s(self.first as f32 - (first * lanes) as f32);
        // How far each sample is from the first of the span.
        let mut offset = simd.sub_f32s(S::as_simd_f32s(&LANE).0[0], before);
        for vector in first..=last {
            let inside = simd.and_m32s(
                simd.greater_than_or_equal_f32s(offset, nothing),
                simd.less_than_f32s(offset, length),
            );
            let nearness = simd.add_f32s(start, simd.mul_f32s(step, offset));
            each(self.row * (grid.stride() / lanes) + vector, simd.select_f32s(inside, nearness, nothing));
            offset = simd.add_f32s(offset, simd.splat_f32s(lanes as f32));
        }
    }
}

/// As `f64::max` and `f64::min`, which care for what is no number.
#[inline(always)]
fn larger(value: f64, min: f64) -> f64 {
    if value > min { value } else { min }
}

#[inline(always)]
fn smaller(value: f64, max: f64) -> f64 {
    if value < max { value } else { max }
}

/// A number that is whole and not negative. It becomes the lowest bits of the sum; a cast would look at each for itself.
#[inline(always)]
fn whole(value: f64) -> u32 {
    const ALL_BITS_WHOLE: f64 = (1u64 << 52) as f64;
    (value + ALL_BITS_WHOLE).to_bits() as u32
}
