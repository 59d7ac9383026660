//! Shadow of the sun around the focus.

use std::ops::Range;

use pulp::Simd;
use rapier3d::math::Vector;

use super::raster::{Grid, Outlines, SampleRows, TriangleBatch, larger, smaller, whole_f32};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::lamp_shadow;
use crate::render::shading::lanes::{Affine, LANES, Lanes, axes, lanes};
use crate::render::shading::{BIAS_M, FADE_TEXELS, TEXELS, normal_offset_m, sun_map};
use crate::render::{Carrier, PlacedScenery};

/// Texels along each side of a cell. A point nearer to the sun than everything in its cell is lit, without a
/// lookup of texels.
const CELL: usize = 8;
const CELLS: usize = TEXELS / CELL;
const _: () = assert!(CELLS == u128::BITS as usize, "a row of cells is the bits of a number");
/// Index of the cell for all points outside the map, which are lit.
const OUTSIDE: u32 = (CELLS * CELLS) as u32;
/// Number of texels that the filter reads along each axis. A cell covers all texels that a filter starting in
/// it can reach.
const TAPS: usize = 4;
const GRID: Grid = Grid { width: TEXELS, height: TEXELS, pitch_px: 1.0 };

#[derive(Default)]
pub(super) struct ShadowMap {
    /// Centre of the map; `None` before the first drawing.
    focus_m: Option<Vector>,
    /// Direction to the sun.
    sun_direction: Vector,
    /// Offset of the lookup point along the normal.
    normal_offset_m: f32,
    map_from_world: Affine,
    /// The room's shadows, which are valid while the focus stays.
    still: ShadowLayer,
    /// The shadows of everything.
    all: ShadowLayer,
    /// Cells in which `all` may differ from `still`: one number per row of cells, one bit per column.
    moving: Vec<u128>,
    corners: Vec<[f32; 3]>,
    front: Vec<u32>,
}

/// Nearness of the surfaces seen from the sun: their position along the direction to the sun, which is
/// [`SUN_DISTANCE_M`] at the focus.
///
/// [`SUN_DISTANCE_M`]: crate::render::shading::SUN_DISTANCE_M
#[derive(Default)]
struct ShadowLayer {
    nearness_m: SampleRows<f32>,
    /// Smallest and largest nearness of each cell, row by row; the last entry is that of [`OUTSIDE`].
    cells_m: Vec<[f32; 2]>,
}

impl ShadowMap {
    /// Discards the map, so that the next shadows are drawn in full.
    pub(super) fn forget(&mut self) {
        self.focus_m = None;
    }

    /// Draws the shadows of everything that casts shadows, for a sun in this direction.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        prepared: &Prepared,
        placed: &PlacedScenery,
        sun_direction: Vector,
    ) {
        if self.focus_m != Some(placed.focus_m) || self.sun_direction != sun_direction {
            (self.focus_m, self.sun_direction) = (Some(placed.focus_m), sun_direction);
            let radius_m = prepared.scenery.focus_radius_m;
            self.normal_offset_m = normal_offset_m(radius_m);
            self.map_from_world = sun_map(sun_direction, placed.focus_m, radius_m);
            self.still.nearness_m.reset(GRID, 0.0);
            self.still.cells_m.resize(CELLS * CELLS + 1, [f32::NEG_INFINITY; 2]);
            self.moving = vec![0; CELLS];
            self.draw_parts(simd, prepared, placed, true);
            self.still.measure(&[u128::MAX; CELLS]);
            self.all.nearness_m.copy(&self.still.nearness_m);
            self.all.cells_m.clone_from(&self.still.cells_m);
        }
        self.all.restore(&self.still, &self.moving);
        self.moving.fill(0);
        self.draw_parts(simd, prepared, placed, false);
        self.all.measure(&self.moving);
    }

    /// Draws the shadows of the room, or the shadows of all other parts, into their layer.
    #[inline(always)]
    fn draw_parts<S: Simd>(&mut self, simd: S, prepared: &Prepared, placed: &PlacedScenery, of_room: bool) {
        let mut batch = TriangleBatch::default();
        let layer = if of_room { &mut self.still } else { &mut self.all };
        for (number, part) in prepared.scenery.parts.iter().enumerate() {
            if !part.casts_shadow || (part.carrier == Carrier::Room) != of_room {
                continue;
            }
            let map_from_mesh = self.map_from_world.after(placed.world_from_mesh[number]);
            let geometry = prepared.geometry(number);
            let (centre_m, around_m) = geometry.bounds;
            let texels = around_m * 0.5 * TEXELS as f32 / prepared.scenery.focus_radius_m;
            let [u, v, _] = map_from_mesh.map(centre_m);
            let around = [u, v].map(|middle| cells(middle - texels, middle + texels));
            if around.iter().any(Range::is_empty) {
                continue;
            }
            geometry.points.map_into(
                &mut self.corners,
                #[inline(always)]
                |block| map_from_mesh.map_lanes(block),
            );
            let [columns, rows] = reached_cells(&self.corners[..geometry.points.count()]);
            let reached =
                u128::MAX.unbounded_shl(columns.start as u32) & !u128::MAX.unbounded_shl(columns.end as u32);
            for moving in &mut self.moving[rows] {
                *moving |= reached;
            }
            let to_sun = placed.world_from_mesh[number].rotation.inverse() * self.sun_direction;
            geometry.faces.put_front(&mut self.front, [to_sun.x, to_sun.y, to_sun.z, 0.0]);
            for triangle in &self.front {
                let corners =
                    geometry.triangles[*triangle as usize].map(|corner| self.corners[corner as usize]);
                batch.push(corners, 0);
                if batch.is_full() {
                    layer.fill(simd, &batch.take());
                }
            }
        }
        layer.fill(simd, &batch.take());
    }

    /// Returns the lookup coordinates of surfaces: column and row, counted from the first texel's
    /// centre, and nearness.
    #[inline(always)]
    pub(super) fn texels(&self, points_m: &[Lanes; 3], normals: &[Lanes; 3]) -> [Lanes; 3] {
        let shifted: [Lanes; 3] = axes(
            #[inline(always)]
            |axis| lanes(|i| points_m[axis][i] + normals[axis][i] * self.normal_offset_m),
        );
        let [u, v, nearness_m] = self.map_from_world.map_lanes(&shifted);
        [lanes(|i| u[i] - 0.5), lanes(|i| v[i] - 0.5), lanes(|i| nearness_m[i] + BIAS_M)]
    }

    /// Returns the light at a point like [`ShadowMap::sunlit`].
    pub(super) fn sunlit_at(&self, point_m: Vector, normal: Vector) -> f32 {
        let [u, v, nearness_m] = self.map_from_world.map(point_m + normal * self.normal_offset_m);
        let inside = 1.0..(TEXELS - 3) as f32;
        let (u, v) = (u - 0.5, v - 0.5);
        if !inside.contains(&u) || !inside.contains(&v) {
            return 1.0;
        }
        let [[cell, ..], ..] = [ShadowMap::cells(&[[u; LANES], [v; LANES], [0.0; LANES]])];
        self.sunlit([u, v, nearness_m + BIAS_M], cell)
    }

    /// Returns the cells of filters that begin at these texels.
    #[inline(always)]
    pub(super) fn cells([u, v, _]: &[Lanes; 3]) -> [u32; LANES] {
        let inside = |i: f32| (i >= 1.0) & (i < (TEXELS - 3) as f32);
        let cell = |i: f32| ((i - 1.0) * (1.0 / CELL as f32)).floor();
        lanes(|i| {
            let number = whole_f32(cell(v[i]) * CELLS as f32 + cell(u[i]));
            if inside(u[i]) & inside(v[i]) { number } else { OUTSIDE }
        })
    }

    /// Returns 1 in the sun, 0 in the shadow, smooth over three texels; points outside the map are in
    /// the sun.
    #[inline(always)]
    pub(super) fn sunlit(&self, [u, v, nearness_m]: [f32; 3], cell: u32) -> f32 {
        let [least_m, greatest_m] = self.all.cells_m[cell as usize];
        if nearness_m < greatest_m {
            let lit = if nearness_m < least_m { 0.0 } else { self.filtered([u, v, nearness_m]) };
            let last = (TEXELS - 1) as f32;
            let to_border = u.min(last - u).min(v.min(last - v));
            1.0 - (1.0 - lit) * (to_border / FADE_TEXELS).min(1.0)
        } else {
            1.0
        }
    }

    /// Returns the light of a wide lamp in the sun's direction, like [`ShadowMap::sunlit`]. Objects far from
    /// a surface block less of it.
    #[inline(always)]
    pub(super) fn lamplit(&self, [u, v, nearness_m]: [f32; 3], cell: u32) -> f32 {
        let [_, greatest_m] = self.all.cells_m[cell as usize];
        if nearness_m >= greatest_m {
            return 1.0;
        }
        let (mut blocked, mut distance_m) = (0.0, 0.0);
        self.for_each_tap([u, v], |weight, occluder_m| {
            let share = if nearness_m >= occluder_m { 0.0 } else { weight };
            blocked += share;
            distance_m += share * (occluder_m - nearness_m);
        });
        let last = (TEXELS - 1) as f32;
        let to_border = u.min(last - u).min(v.min(last - v));
        1.0 - lamp_shadow(blocked, distance_m) * (to_border / FADE_TEXELS).min(1.0)
    }

    /// Visits the taps of a filter with their weights, whose sum is 1.
    #[inline(always)]
    fn for_each_tap(&self, [u, v]: [f32; 2], mut visit: impl FnMut(f32, f32)) {
        let (column, row) = (usize::from(u as u16), usize::from(v as u16));
        let weights = |part: f32| [1.0 - part, 1.0, 1.0, part].map(|weight| weight / 3.0);
        let (across, down) = (weights(u - column as f32), weights(v - row as f32));
        for (down, occluders) in down.into_iter().zip(self.all.nearness_m.rows_from(row - 1, column - 1)) {
            for (across, occluder_m) in across.into_iter().zip(occluders) {
                visit(across * down, *occluder_m);
            }
        }
    }

    /// Filters bilinearly over three texels: four taps with a tent's weights along each axis.
    #[inline(always)]
    fn filtered(&self, [u, v, nearness_m]: [f32; 3]) -> f32 {
        let (column, row) = (usize::from(u as u16), usize::from(v as u16));
        let weights = |part: f32| [1.0 - part, 1.0, 1.0, part];
        let (across, down) = (weights(u - column as f32), weights(v - row as f32));
        let mut columns = [0.0; TAPS];
        for (weight, occluders) in down.into_iter().zip(self.all.nearness_m.rows_from(row - 1, column - 1)) {
            let occluders = occluders.first_chunk::<TAPS>().expect("no filter reaches over the border");
            for i in 0..TAPS {
                columns[i] += if nearness_m >= occluders[i] { weight } else { 0.0 };
            }
        }
        (columns[0] * across[0] + columns[1] * across[1] + columns[2] * across[2] + columns[3] * across[3])
            / 9.0
    }
}

impl ShadowLayer {
    /// Restores the moving cells to their state without moving parts.
    fn restore(&mut self, still: &ShadowLayer, moving: &[u128]) {
        let of_rows = moving.iter().enumerate();
        for (row, columns) in of_rows.flat_map(|(row, moving)| runs(*moving).map(move |run| (row, run))) {
            let of_row = row * CELLS + columns.start..row * CELLS + columns.end;
            self.cells_m[of_row.clone()].copy_from_slice(&still.cells_m[of_row]);
            for row in row * CELL..(row + 1) * CELL {
                let texels = columns.start * CELL..columns.end * CELL;
                let kept = &still.nearness_m.row(row)[texels.clone()];
                self.nearness_m.row_mut(row)[texels].copy_from_slice(kept);
            }
        }
    }

    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, outlines: &Outlines) {
        let nearest = S::as_mut_simd_f32s(self.nearness_m.all_mut()).0;
        outlines.draw(
            simd,
            GRID,
            #[inline(always)]
            |i, _, nearness_m| nearest[i] = simd.max_f32s(nearest[i], nearness_m),
        );
    }

    /// Computes the least and the greatest nearness of some cells.
    #[inline(always)]
    fn measure(&mut self, drawn: &[u128]) {
        for (row, drawn) in drawn.iter().enumerate() {
            for columns in runs(*drawn) {
                self.measure_run(row, columns);
            }
        }
    }

    /// Measures a run of cells from right to left, since a cell extends over the first texels of the next.
    #[inline(always)]
    fn measure_run(&mut self, row: usize, columns: Range<usize>) {
        let mut beside = [f32::INFINITY, 0.0];
        for column in (columns.start..(columns.end + 1).min(CELLS)).rev() {
            let (mut least, mut greatest) = ([f32::INFINITY; CELL], [0.0; CELL]);
            for row in row * CELL..((row + 1) * CELL + TAPS - 1).min(TEXELS) {
                let texels = self.nearness_m.row(row)[column * CELL..].first_chunk::<CELL>();
                let texels = texels.expect("a row consists of whole cells");
                least = lanes(|i| smaller(texels[i], least[i]));
                greatest = lanes(|i| larger(texels[i], greatest[i]));
            }
            let both = |values: Range<usize>| {
                [
                    least[values.clone()].iter().copied().fold(f32::INFINITY, smaller),
                    greatest[values].iter().copied().fold(0.0, larger),
                ]
            };
            let first = both(0..TAPS - 1);
            if columns.contains(&column) {
                let others = both(TAPS - 1..CELL);
                self.cells_m[row * CELLS + column] = [
                    smaller(smaller(first[0], others[0]), beside[0]),
                    larger(larger(first[1], others[1]), beside[1]),
                ];
            }
            beside = first;
        }
    }
}

/// Returns the columns and rows of the cells whose filters reach the bounds of some corners.
fn reached_cells(corners: &[[f32; 3]]) -> [Range<usize>; 2] {
    let mut low = [f32::INFINITY; 2];
    let mut high = [f32::NEG_INFINITY; 2];
    for [u, v, _] in corners {
        low = [smaller(*u, low[0]), smaller(*v, low[1])];
        high = [larger(*u, high[0]), larger(*v, high[1])];
    }
    [cells(low[0], high[0]), cells(low[1], high[1])]
}

/// Returns the runs of columns whose bits are set.
fn runs(mut columns: u128) -> impl Iterator<Item = Range<usize>> {
    std::iter::from_fn(move || {
        let start = columns.trailing_zeros();
        let end = start + columns.unbounded_shr(start).trailing_ones();
        columns &= u128::MAX.unbounded_shl(end);
        (start < end).then_some(start as usize..end as usize)
    })
}

/// Returns the cells whose filters reach the range between two texels.
fn cells(low_px: f32, high_px: f32) -> Range<usize> {
    let cell = |texel: f32| texel.clamp(0.0, TEXELS as f32) as usize / CELL;
    cell(low_px - TAPS as f32)..(cell(high_px) + 1).min(CELLS)
}
