//! Rasteriser: the samples of a picture, row by row; which of them lie in a triangle, and how near it is there.

use pulp::Simd;

use crate::render::shading::lanes::{LANES, Lanes, lanes};

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

/// Projected triangles that wait until there are as many as are prepared at once.
#[derive(Default)]
pub struct TriangleBatch {
    count: usize,
    /// For each corner its picture coordinates and its nearness.
    corners: [[Lanes; 3]; 3],
    /// What each triangle is drawn as.
    tags: [u32; LANES],
}

/// The pictures of some triangles.
///
/// Their planes and the edges of large ones are f64: a floor triangle clipped at the near plane has corners 1e4 pixels off the
/// picture, and f32 gradients would err by centimetres. In f64 the edge that two triangles share also comes out
/// the same for both, to the bit, and leaves no gap.
pub struct Outlines {
    count: usize,
    corners: [[Lanes; 3]; 3],
    tags: [u32; LANES],
    /// Picture coordinates of the corners.
    places: [[Wide; 2]; 3],
    /// Nearness at the first corner, and how it changes.
    nearness_value: Wide,
    x_factor: Wide,
    y_factor: Wide,
    /// Whether the camera sees the corners counter-clockwise.
    front: [bool; LANES],
}

type Wide = [f64; LANES];

/// The samples of a grid that triangles can reach, the last ones included.
struct Reaches {
    some: [bool; LANES],
    x0: [u32; LANES],
    x1: [u32; LANES],
    y0: [u32; LANES],
    y1: [u32; LANES],
}

/// The samples of a grid that a triangle can reach, the last ones included.
#[derive(Clone, Copy)]
struct Reach {
    x0: u32,
    x1: u32,
    y0: u32,
    y1: u32,
}

/// What changes linearly over small triangles, in the order of `EDGES` and then nearness: from sample to sample, from row to row, and
/// what it is in their first rows at the beginning of their first block and of the next.
struct Slopes {
    across: [Lanes; 4],
    down: [Lanes; 4],
    starts: [[Lanes; 4]; SMALL_BLOCKS],
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
    /// The first column and the first one beyond: whole numbers.
    column_values: [f32; 2],
    start_value: f32,
    step_value: f32,
}

/// Corners that edges go from and to.
const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];
/// Rows of a large triangle that are measured at once.
const ROWS: usize = 4;
/// A triangle is small if it is no higher, and reaches into no more blocks of each row.
const SMALL_ROWS: u32 = 16;
const SMALL_BLOCKS: usize = 2;
/// In so few blocks a large triangle is drawn wherever its rows begin and end: where they do is hard to foresee for processors.
const NARROW_BLOCKS: usize = 5;
/// A small triangle is drawn this far beyond its edges, in parts of their lengths: f32 then leaves no gaps.
const OVERLAP: f32 = 1e-5;
const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

impl TriangleBatch {
    pub fn is_full(&self) -> bool {
        self.count == LANES
    }

    /// Adds a triangle, for which there has to be room. Corners are picture coordinates and nearness.
    #[inline(always)]
    pub fn push(&mut self, corners: [[f32; 3]; 3], tag: u32) {
        let place = self.count % LANES;
        for (lanes, numbers) in self.corners.iter_mut().zip(corners) {
            for (lanes, number) in lanes.iter_mut().zip(numbers) {
                lanes[place] = number;
            }
        }
        self.tags[place] = tag;
        self.count += 1;
    }

    /// Takes all that wait.
    #[inline(always)]
    pub fn take(&mut self) -> Outlines {
        let corners = self.corners;
        let places = corners.map(|[x, y, _]| [wide(&x), wide(&y)]);
        let [[ax, ay], [bx, by], [cx, cy]] = &places;
        let [an, bn, cn] = corners.map(|[_, _, nearness]| wide(&nearness));
        let minus = |to: &Wide, from: &Wide| -> Wide { lanes(|i| to[i] - from[i]) };
        let (ux, uy, un) = (minus(bx, ax), minus(by, ay), minus(&bn, &an));
        let (vx, vy, vn) = (minus(cx, ax), minus(cy, ay), minus(&cn, &an));
        // Rows count downwards, so that what is counter-clockwise has a negative area.
        let area: Wide = lanes(|i| ux[i] * vy[i] - uy[i] * vx[i]);
        let per_area: Wide = lanes(|i| 1.0 / area[i]);
        Outlines {
            count: std::mem::take(&mut self.count),
            corners,
            tags: self.tags,
            x_factor: lanes(|i| (un[i] * vy[i] - vn[i] * uy[i]) * per_area[i]),
            y_factor: lanes(|i| (vn[i] * ux[i] - un[i] * vx[i]) * per_area[i]),
            front: lanes(|i| area[i] < 0.0 && area[i] > f64::NEG_INFINITY),
            nearness_value: an,
            places,
        }
    }
}

impl Outlines {
    /// Calls `each` for all vectors of samples that front faces reach into, with their number in the grid, the triangle's tag and the
    /// nearness of their samples: 0 for those outside of it.
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

    /// In f32 this is exact: where halves are lost, a coordinate is outside of the picture.
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

    /// An edge from p to q has those samples on its inner side where `(x - px) (qy - py) - (y - py) (qx - px) >= 0`.
    #[inline(always)]
    fn slopes(&self, grid: Grid, reaches: &Reaches) -> Slopes {
        let pitch = grid.pitch_px as f32;
        let y: Wide = lanes(|i| (f64::from(reaches.y0[i]) + 0.5) * grid.pitch_px);
        let xs: [Wide; SMALL_BLOCKS] = std::array::from_fn(|next| {
            lanes(|i| {
                let block = reaches.x0[i] / LANES as u32 + next as u32;
                (f64::from(block * LANES as u32) + 0.5) * grid.pitch_px
            })
        });
        let mut slopes = Slopes {
            across: [[0.0; LANES]; 4],
            down: [[0.0; LANES]; 4],
            starts: [[[0.0; LANES]; 4]; SMALL_BLOCKS],
        };
        for (edge, [from, to]) in EDGES.into_iter().enumerate() {
            let ([px, py], [qx, qy]) = (&self.places[from], &self.places[to]);
            let right: Lanes = lanes(|i| (qx[i] - px[i]) as f32);
            let down: Lanes = lanes(|i| (qy[i] - py[i]) as f32);
            let below: Lanes = lanes(|i| (y[i] - py[i]) as f32);
            for (starts, x) in slopes.starts.iter_mut().zip(&xs) {
                starts[edge] = lanes(|i| {
                    let overlap = OVERLAP * (right[i].abs() + down[i].abs());
                    (x[i] - px[i]) as f32 * down[i] - below[i] * right[i] + overlap
                });
            }
            slopes.across[edge] = lanes(|i| down[i] * pitch);
            slopes.down[edge] = lanes(|i| -right[i] * pitch);
        }
        let [ax, ay] = &self.places[0];
        for (starts, x) in slopes.starts.iter_mut().zip(&xs) {
            starts[3] = lanes(|i| {
                (self.nearness_value[i]
                    + self.x_factor[i] * (x[i] - ax[i])
                    + self.y_factor[i] * (y[i] - ay[i])) as f32
            });
        }
        slopes.across[3] = lanes(|i| (self.x_factor[i] * grid.pitch_px) as f32);
        slopes.down[3] = lanes(|i| (self.y_factor[i] * grid.pitch_px) as f32);
        slopes
    }

    /// Measures where each row begins and ends.
    #[inline(always)]
    fn draw_large<S: Simd>(
        &self,
        simd: S,
        grid: Grid,
        reach: Reach,
        i: usize,
        each: &mut impl FnMut(usize, u32, S::f32s),
    ) {
        let (left, right) = self.edges(i);
        let per_pitch = 1.0 / grid.pitch_px;
        let (x0, x1) = (f64::from(reach.x0), f64::from(reach.x1));
        let narrow = reach.blocks() < NARROW_BLOCKS;
        let [ax, ay] = self.places[0].each_ref().map(|place| place[i]);
        let (nearness_value, x_factor, y_factor) =
            (self.nearness_value[i], self.x_factor[i], self.y_factor[i]);
        for top in (reach.y0..=reach.y1).step_by(ROWS) {
            let (mut firsts, mut ends, mut starts) = ([0.0; ROWS], [0.0; ROWS], [0.0; ROWS]);
            for row in 0..ROWS {
                let y = (f64::from(top + row as u32) + 0.5) * grid.pitch_px;
                let x = |edge: Edge| (edge.slope_ratio * y + edge.offset_value) * per_pitch - 0.5;
                let first = smaller(larger(larger(x(left[0]), x(left[1])), x0).ceil(), x1 + 1.0);
                let end = larger(smaller(smaller(x(right[0]), x(right[1])), x1).floor() + 1.0, x0);
                let start = x_factor * ((first + 0.5) * grid.pitch_px - ax) + y_factor * (y - ay);
                (firsts[row], ends[row]) = (first as f32, end as f32);
                starts[row] = (nearness_value + start) as f32;
            }
            for row in 0..ROWS.min((reach.y1 - top + 1) as usize) {
                let (column_values, start_value) = ([firsts[row], ends[row]], starts[row]);
                let step_value = (x_factor * grid.pitch_px) as f32;
                let span = Span { row: top as usize + row, column_values, start_value, step_value };
                if narrow {
                    span.draw_within(simd, grid, reach, self.tags[i], each);
                } else if firsts[row] < ends[row] {
                    span.draw(simd, grid, self.tags[i], each);
                }
            }
        }
    }

    /// What is inside lies to the right of the first two, and to the left of the others.
    #[inline(always)]
    fn edges(&self, i: usize) -> ([Edge; 2], [Edge; 2]) {
        let mut left = [Edge { slope_ratio: 0.0, offset_value: f64::NEG_INFINITY }; 2];
        let mut right = [Edge { slope_ratio: 0.0, offset_value: f64::INFINITY }; 2];
        let (mut lefts, mut rights) = (0, 0);
        for [from, to] in EDGES {
            let [[px, py], [qx, qy]] =
                [from, to].map(|corner| self.places[corner].each_ref().map(|place| place[i]));
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

impl Slopes {
    /// Looks at each sample of a small triangle.
    #[inline(always)]
    fn draw<S: Simd>(
        &self,
        simd: S,
        grid: Grid,
        reach: Reach,
        (i, tag): (usize, u32),
        each: &mut impl FnMut(usize, u32, S::f32s),
    ) {
        let per_block = LANES / S::F32_LANES;
        let nothing = simd.splat_f32s(0.0);
        let [down_a, down_b, down_c, down] = &self.down;
        let (down_a, down_b) = (simd.splat_f32s(down_a[i]), simd.splat_f32s(down_b[i]));
        let (down_c, down) = (simd.splat_f32s(down_c[i]), simd.splat_f32s(down[i]));
        let (first, last) = (reach.x0 as usize / LANES, reach.x1 as usize / LANES);
        for (block, starts) in (first..=last).zip(&self.starts) {
            for (part, lane) in S::as_simd_f32s(&LANE).0.iter().enumerate() {
                let mut a = linear(simd, starts[0][i], self.across[0][i], *lane);
                let mut b = linear(simd, starts[1][i], self.across[1][i], *lane);
                let mut c = linear(simd, starts[2][i], self.across[2][i], *lane);
                let mut nearness = linear(simd, starts[3][i], self.across[3][i], *lane);
                let mut vector =
                    reach.y0 as usize * (grid.stride() / S::F32_LANES) + block * per_block + part;
                for _ in reach.y0..=reach.y1 {
                    let inside =
                        simd.greater_than_or_equal_f32s(simd.min_f32s(a, simd.min_f32s(b, c)), nothing);
                    each(vector, tag, simd.select_f32s(inside, nearness, nothing));
                    (a, b, c) =
                        (simd.add_f32s(a, down_a), simd.add_f32s(b, down_b), simd.add_f32s(c, down_c));
                    nearness = simd.add_f32s(nearness, down);
                    vector += grid.stride() / S::F32_LANES;
                }
            }
        }
    }
}

impl Reach {
    /// How many blocks of each row it is in.
    #[inline(always)]
    fn blocks(self) -> usize {
        self.x1 as usize / LANES - self.x0 as usize / LANES + 1
    }
}

impl Span {
    /// Goes through all blocks that the triangle can reach.
    #[inline(always)]
    fn draw_within<S: Simd>(
        self,
        simd: S,
        grid: Grid,
        reach: Reach,
        tag: u32,
        each: &mut impl FnMut(usize, u32, S::f32s),
    ) {
        let lanes = S::F32_LANES;
        let nothing = simd.splat_f32s(0.0);
        let (start, step) = (simd.splat_f32s(self.start_value), simd.splat_f32s(self.step_value));
        let [first_value, end_value] = self.column_values;
        let (first, end) = (simd.splat_f32s(first_value), simd.splat_f32s(end_value));
        let vectors = reach.x0 as usize / lanes..=reach.x1 as usize / lanes;
        let mut column =
            simd.add_f32s(S::as_simd_f32s(&LANE).0[0], simd.splat_f32s((vectors.start() * lanes) as f32));
        for vector in vectors {
            let nearness = simd.add_f32s(start, simd.mul_f32s(step, simd.sub_f32s(column, first)));
            let inside = simd
                .and_m32s(simd.greater_than_or_equal_f32s(column, first), simd.less_than_f32s(column, end));
            each(
                self.row * (grid.stride() / lanes) + vector,
                tag,
                simd.select_f32s(inside, nearness, nothing),
            );
            column = simd.add_f32s(column, simd.splat_f32s(lanes as f32));
        }
    }

    #[inline(always)]
    fn draw<S: Simd>(self, simd: S, grid: Grid, tag: u32, each: &mut impl FnMut(usize, u32, S::f32s)) {
        let lanes = S::F32_LANES;
        let [first_value, end_value] = self.column_values;
        let (first, last) =
            (whole_f32(first_value) as usize / lanes, (whole_f32(end_value) as usize - 1) / lanes);
        let nothing = simd.splat_f32s(0.0);
        let (start, step) = (simd.splat_f32s(self.start_value), simd.splat_f32s(self.step_value));
        let length = simd.splat_f32s(end_value - first_value);
        let before = simd.splat_f32s(first_value - (first * lanes) as f32);
        let start_vector = self.row * (grid.stride() / lanes);
        // How far each sample is from the first of the span.
        let mut offset = simd.sub_f32s(S::as_simd_f32s(&LANE).0[0], before);
        for vector in first..=last {
            let mut nearness = simd.add_f32s(start, simd.mul_f32s(step, offset));
            // Only the first and the last reach beyond the span.
            if vector == first || vector == last {
                let inside = simd.and_m32s(
                    simd.greater_than_or_equal_f32s(offset, nothing),
                    simd.less_than_f32s(offset, length),
                );
                nearness = simd.select_f32s(inside, nearness, nothing);
            }
            each(start_vector + vector, tag, nearness);
            offset = simd.add_f32s(offset, simd.splat_f32s(lanes as f32));
        }
    }
}

#[inline(always)]
fn linear<S: Simd>(simd: S, start_value: f32, step_value: f32, lane: S::f32s) -> S::f32s {
    simd.add_f32s(simd.splat_f32s(start_value), simd.mul_f32s(simd.splat_f32s(step_value), lane))
}

#[inline(always)]
fn wide(values: &Lanes) -> Wide {
    lanes(|i| f64::from(values[i]))
}

/// As `max` and `min` of numbers, which care for what is no number.
#[inline(always)]
pub fn larger<T: PartialOrd>(value: T, min: T) -> T {
    if value > min { value } else { min }
}

#[inline(always)]
pub fn smaller<T: PartialOrd>(value: T, max: T) -> T {
    if value < max { value } else { max }
}

/// A number that is whole, not negative and below 8 million. It becomes the lowest bits of the sum; a cast would look at each for
/// itself.
#[inline(always)]
pub fn whole_f32(value: f32) -> u32 {
    const ALL_BITS_WHOLE: f32 = (1u32 << 23) as f32;
    (value + ALL_BITS_WHOLE).to_bits() & ((1 << 23) - 1)
}
