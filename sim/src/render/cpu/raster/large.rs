//! Large triangles: the start and end of each row of samples are computed.

use pulp::Simd;

use super::{EDGES, Grid, LANE, Outlines, Reach, larger, smaller, whole_f32};

/// Line of an edge: `x = slope_ratio * y + offset_value`.
#[derive(Clone, Copy)]
struct Edge {
    slope_ratio: f64,
    offset_value: f64,
}

/// Samples of a triangle in one row of a grid: nearness at the first sample, and its step from sample to
/// sample.
#[derive(Clone, Copy)]
struct Span {
    row: usize,
    /// First column of the span and first column beyond it: whole numbers.
    column_values: [f32; 2],
    start_value: f32,
    step_value: f32,
}

/// Number of rows of a large triangle that are computed at once.
const ROWS: usize = 4;
/// Maximum number of blocks per row for which a large triangle is drawn in all of them, regardless of
/// where its rows start and end: branch prediction cannot foresee these.
const NARROW_BLOCKS: usize = 5;

impl Outlines {
    /// Computes the start and end of each row.
    #[inline(always)]
    pub(super) fn draw_large<S: Simd>(
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

    /// Returns the edges; the inside is to the right of the first two, and to the left of the others.
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

impl Span {
    /// Visits all blocks that the triangle can reach.
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
        // Distance of each sample from the first of the span.
        let mut offset = simd.sub_f32s(S::as_simd_f32s(&LANE).0[0], before);
        for vector in first..=last {
            let mut nearness = simd.add_f32s(start, simd.mul_f32s(step, offset));
            // Only the first and the last extend beyond the span.
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
