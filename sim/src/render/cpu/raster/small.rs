//! Small triangles: every sample that they can reach is tested.

use pulp::Simd;

use super::{EDGES, Grid, LANE, Outlines, Reach, Reaches, Wide};
use crate::render::shading::lanes::{LANES, Lanes, lanes};

/// Linear functions over small triangles, in the order of `EDGES` and then nearness. They are given by
/// their steps from sample to sample and from row to row, and by their start values. The latter are
/// those in the first row at the beginning of the first block and of the next.
pub(super) struct Slopes {
    across: [Lanes; 4],
    down: [Lanes; 4],
    starts: [[Lanes; 4]; SMALL_BLOCKS],
}

/// Maximum height of a small triangle, and maximum number of blocks that it spans in each row.
pub(super) const SMALL_ROWS: u32 = 16;
pub(super) const SMALL_BLOCKS: usize = 2;
/// Extension of a small triangle beyond its edges, as a share of their lengths: f32 then leaves no gaps.
const OVERLAP: f32 = 1e-5;

impl Outlines {
    /// Computes the slopes. An edge from p to q has those samples on its inner side where
    /// `(x - px) (qy - py) - (y - py) (qx - px) >= 0`.
    #[inline(always)]
    pub(super) fn slopes(&self, grid: Grid, reaches: &Reaches) -> Slopes {
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
}

impl Slopes {
    /// Tests each sample of a small triangle.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
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

#[inline(always)]
fn linear<S: Simd>(simd: S, start_value: f32, step_value: f32, lane: S::f32s) -> S::f32s {
    simd.add_f32s(simd.splat_f32s(start_value), simd.mul_f32s(simd.splat_f32s(step_value), lane))
}
