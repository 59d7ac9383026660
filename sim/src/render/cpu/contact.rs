//! Contact shadows: soft darkness where bodies nearly touch their support, which distinguishes standing from
//! hovering.

use pulp::{Arch, Simd, WithSimd};
use rapier3d::math::Vector;

use super::raster::{Grid, Outlines, SampleRows, TriangleBatch};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::CONTACT_TEXELS;
use crate::render::shading::lanes::{Affine, Lanes, lanes};
use crate::render::{Carrier, Part, PlacedScenery};

/// Height above a surface at which a body no longer darkens it.
const REACH_M: f32 = 0.06;
/// Maximum depth to which bodies sink into their support.
pub const SINK_M: f32 = 0.03;
/// Maximum height of a support.
const HIGHEST_SUPPORT_M: f32 = 1.5;
/// Offset that makes heights positive, since they are drawn as nearness.
const DATUM_M: f32 = 4.0;
/// Weights of a texel's neighbours in each direction.
const BLUR: [f32; 5] = [1.0 / 9.0, 2.0 / 9.0, 3.0 / 9.0, 2.0 / 9.0, 1.0 / 9.0];
/// Texels along each side of a square that is tested as a whole.
const CELL: usize = 8;
const CELLS: usize = CONTACT_TEXELS / CELL;
const GRID: Grid = Grid { width: CONTACT_TEXELS, height: CONTACT_TEXELS, pitch_px: 1.0 };

/// The surroundings of the focus, seen from above. Columns run along the world's x, rows along y.
#[derive(Default)]
pub struct ContactMap {
    /// World coordinates of its first corner, and texels per metre.
    pub corner_m: [f32; 2],
    pub texels_per_m: f32,
    /// For each texel, row by row: the height of the support, and the darkness there, from 0 to 1.
    pub texel_values: Vec<[f32; 2]>,
    /// Centre of the map; `None` before the first drawing. The support is redrawn when it changes.
    focus_m: Option<Vector>,
    support: SampleRows<f32>,
    underside: SampleRows<f32>,
    corners_m: Vec<[f32; 3]>,
    /// Darkness smoothed along the rows, and true for rows with any darkness.
    across_share: Vec<[f32; CONTACT_TEXELS]>,
    across_dark: Vec<bool>,
    /// Rows whose texels have to be written: they were dark, or do not have the present support yet.
    stale_rows: Vec<bool>,
    /// True for squares of texels with darkness in them or right beside them, row by row. Most squares have
    /// none.
    dark_cells: Vec<bool>,
}

/// Drawing of a map, compiled for the available registers.
struct ContactDrawing<'a> {
    map: &'a mut ContactMap,
    prepared: &'a Prepared,
    placed: &'a PlacedScenery,
}

impl WithSimd for ContactDrawing<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        self.map.draw_with(simd, self.prepared, self.placed);
    }
}

impl ContactMap {
    /// Discards the map, so that the next one is drawn in full.
    pub fn forget(&mut self) {
        self.focus_m = None;
    }

    pub fn draw(&mut self, prepared: &Prepared, placed: &PlacedScenery) {
        Arch::new().dispatch(ContactDrawing { map: self, prepared, placed });
    }

    #[inline(always)]
    fn draw_with<S: Simd>(&mut self, simd: S, prepared: &Prepared, placed: &PlacedScenery) {
        if self.focus_m != Some(placed.focus_m) {
            let radius_m = prepared.scenery.focus_radius_m;
            self.focus_m = Some(placed.focus_m);
            self.corner_m = [placed.focus_m.x - radius_m, placed.focus_m.y - radius_m];
            self.texels_per_m = CONTACT_TEXELS as f32 / (2.0 * radius_m);
            self.support.reset(GRID, 0.0);
            self.draw_layer(simd, prepared, placed, HeightLayer::Support);
            self.stale_rows = vec![true; CONTACT_TEXELS];
        }
        self.underside.reset(GRID, 0.0);
        self.draw_layer(simd, prepared, placed, HeightLayer::Underside);
        self.darken();
    }

    #[inline(always)]
    fn draw_layer<S: Simd>(
        &mut self,
        simd: S,
        prepared: &Prepared,
        placed: &PlacedScenery,
        layer: HeightLayer,
    ) {
        let mut batch = TriangleBatch::default();
        let parts = prepared.scenery.parts.iter().enumerate();
        for (number, part) in parts.filter(|(number, _)| !prepared.is_veil[*number]) {
            let (pose, geometry) = (placed.world_from_mesh[number], prepared.geometry(number));
            let (centre_m, around_m) = geometry.bounds;
            if layer != HeightLayer::of(part) || !self.concerns(layer, pose * centre_m, around_m) {
                continue;
            }
            let world_from_mesh = Affine::of(pose);
            geometry.points.map_into(
                &mut self.corners_m,
                #[inline(always)]
                |block| world_from_mesh.map_lanes(block),
            );
            let too_high = |[_, _, z_m]: &[f32; 3]| *z_m > HIGHEST_SUPPORT_M;
            let mut corners_m = self.corners_m[..geometry.points.count()].iter();
            if layer == HeightLayer::Support && corners_m.any(too_high) {
                continue;
            }
            for triangle in &geometry.triangles {
                batch.push(self.projected(layer, triangle.map(|corner| self.corners_m[corner as usize])), 0);
                if batch.is_full() {
                    self.fill(simd, layer, &batch.take());
                }
            }
        }
        self.fill(simd, layer, &batch.take());
    }

    /// Returns true if a part is over the map and near a surface that it could touch. A sphere bounds the
    /// part.
    fn concerns(&self, layer: HeightLayer, centre_m: Vector, around_m: f32) -> bool {
        let [u, v] = self.place(centre_m);
        let around = around_m * self.texels_per_m;
        let over = |i: f32| i > -around && i < CONTACT_TEXELS as f32 + around;
        if !over(u) || !over(v) || layer == HeightLayer::Support {
            return over(u) && over(v);
        }
        let column = (u.max(0.0) as usize).min(CONTACT_TEXELS - 1);
        let row = (v.max(0.0) as usize).min(CONTACT_TEXELS - 1);
        let support_m = self.support.row(row)[column] - DATUM_M;
        let (low_m, high_m) = (centre_m.z - around_m, centre_m.z + around_m);
        low_m < support_m + REACH_M && high_m > support_m - SINK_M
    }

    /// Returns the column and row of the texel below a point, counted from the corner.
    #[inline(always)]
    fn place(&self, point_m: Vector) -> [f32; 2] {
        let [x_m, y_m] = self.corner_m;
        [(point_m.x - x_m) * self.texels_per_m, (point_m.y - y_m) * self.texels_per_m]
    }

    /// Projects a triangle to the map. Rows run along y, unlike in images, so a triangle seen
    /// counter-clockwise faces down.
    #[inline(always)]
    fn projected(&self, layer: HeightLayer, [a, b, c]: [[f32; 3]; 3]) -> [[f32; 3]; 3] {
        let ([x_m, y_m], scale) = (self.corner_m, self.texels_per_m);
        match layer {
            HeightLayer::Support => {
                [a, c, b].map(|[x, y, z]| [(x - x_m) * scale, (y - y_m) * scale, DATUM_M + z])
            }
            HeightLayer::Underside => {
                [a, b, c].map(|[x, y, z]| [(x - x_m) * scale, (y - y_m) * scale, DATUM_M - z])
            }
        }
    }

    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, layer: HeightLayer, outlines: &Outlines) {
        let rows = match layer {
            HeightLayer::Support => &mut self.support,
            HeightLayer::Underside => &mut self.underside,
        };
        let nearest = S::as_mut_simd_f32s(rows.all_mut()).0;
        outlines.draw(
            simd,
            GRID,
            #[inline(always)]
            |i, _, nearness_m| nearest[i] = simd.max_f32s(nearest[i], nearness_m),
        );
    }

    /// Darkens texels where the lowest underside is near the support, and smooths the darkness. Most rows
    /// have no darkness, and stay unchanged.
    #[inline(always)]
    fn darken(&mut self) {
        self.dark_cells.clear();
        self.dark_cells.resize(CELLS * CELLS, false);
        self.across_share.resize(CONTACT_TEXELS, [0.0; CONTACT_TEXELS]);
        self.across_dark.resize(CONTACT_TEXELS, false);
        self.texel_values.resize(CONTACT_TEXELS * CONTACT_TEXELS, [0.0; 2]);
        for row in 0..CONTACT_TEXELS {
            let dark = row_darkness(self.support.row(row), self.underside.row(row));
            let is_dark = any(&dark);
            if is_dark {
                self.across_share[row] = blurred(|offset, i| dark[shifted(i, offset)]);
            } else if self.across_dark[row] {
                self.across_share[row] = [0.0; CONTACT_TEXELS];
            }
            self.across_dark[row] = is_dark;
        }
        for row in 0..CONTACT_TEXELS {
            let near: [usize; BLUR.len()] = std::array::from_fn(|offset| shifted(row, offset));
            let is_dark = near.iter().any(|near| self.across_dark[*near]);
            if is_dark {
                let rows = near.map(|near| &self.across_share[near]);
                let dark = blurred(|offset, i| rows[offset][i]);
                self.mark_cells(row, &dark);
                self.write_row(row, &dark);
            } else if self.stale_rows[row] {
                self.write_row(row, &[0.0; CONTACT_TEXELS]);
            }
            self.stale_rows[row] = is_dark;
        }
    }

    #[inline(always)]
    fn write_row(&mut self, row: usize, dark_share: &[f32; CONTACT_TEXELS]) {
        let texels = &mut self.texel_values[row * CONTACT_TEXELS..(row + 1) * CONTACT_TEXELS];
        for ((texel, nearness_m), dark) in texels.iter_mut().zip(self.support.row(row)).zip(dark_share) {
            *texel = [nearness_m - DATUM_M, *dark];
        }
    }

    fn mark_cells(&mut self, row: usize, dark_share: &[f32; CONTACT_TEXELS]) {
        for (column, _) in dark_share.iter().enumerate().filter(|(_, dark)| **dark > 0.0) {
            for row in [row.saturating_sub(1), row] {
                self.dark_cells[row / CELL * CELLS + column.saturating_sub(1) / CELL] = true;
                self.dark_cells[row / CELL * CELLS + column / CELL] = true;
            }
        }
    }

    /// Returns the darkness at points of the world: 0 if they are not near the support.
    #[inline(always)]
    pub fn darkness<const N: usize>(&self, [x_m, y_m, z_m]: &[Lanes<N>; 3]) -> Lanes<N> {
        let u: Lanes<N> = lanes(|i| (x_m[i] - self.corner_m[0]) * self.texels_per_m - 0.5);
        let v: Lanes<N> = lanes(|i| (y_m[i] - self.corner_m[1]) * self.texels_per_m - 0.5);
        let mut darkness = [0.0; N];
        for i in 0..N {
            let last = (CONTACT_TEXELS - 1) as f32;
            if u[i] >= 0.0 && u[i] < last && v[i] >= 0.0 && v[i] < last {
                darkness[i] = self.darkness_at(u[i], v[i], z_m[i]);
            }
        }
        darkness
    }

    #[inline(always)]
    fn darkness_at(&self, u_px: f32, v_px: f32, z_m: f32) -> f32 {
        let (column, row) = (usize::from(u_px as u16), usize::from(v_px as u16));
        if !self.dark_cells[row / CELL * CELLS + column / CELL] {
            return 0.0;
        }
        let at = |j: usize, i: usize| self.texel_values[(row + j) * CONTACT_TEXELS + column + i];
        let (right, down) = (u_px - column as f32, v_px - row as f32);
        let [height_m, _] = at(usize::from(down >= 0.5), usize::from(right >= 0.5));
        if (z_m - height_m).abs() > SINK_M {
            return 0.0;
        }
        let along = |j: usize| at(j, 0)[1] * (1.0 - right) + at(j, 1)[1] * right;
        along(0) * (1.0 - down) + along(1) * down
    }
}

/// Layers of the map: drawn from above and from below.
#[derive(Clone, Copy, PartialEq)]
enum HeightLayer {
    Support,
    Underside,
}

impl HeightLayer {
    fn of(part: &Part) -> HeightLayer {
        match part.carrier {
            Carrier::Room => HeightLayer::Support,
            Carrier::Link { .. } | Carrier::Object(_) => HeightLayer::Underside,
        }
    }
}

/// Returns the darkness of a row of texels, before smoothing.
#[inline(always)]
fn row_darkness(support_m: &[f32], underside_m: &[f32]) -> [f32; CONTACT_TEXELS] {
    let mut dark = [0.0; CONTACT_TEXELS];
    // Nothing is above a texel without an underside.
    if any(underside_m) {
        for ((dark, support), underside) in dark.iter_mut().zip(support_m).zip(underside_m) {
            let gap_m = 2.0 * DATUM_M - underside - support;
            let near = (1.0 - gap_m / REACH_M).clamp(0.0, 1.0);
            *dark = if gap_m > -SINK_M { near } else { 0.0 };
        }
    }
    dark
}

/// Returns true if one of the numbers is not 0.
#[inline(always)]
fn any(values: &[f32]) -> bool {
    values.iter().fold(0, |bits, value| bits | value.to_bits()) != 0
}

#[inline(always)]
fn blurred(at: impl Fn(usize, usize) -> f32) -> [f32; CONTACT_TEXELS] {
    let mut sums = [0.0; CONTACT_TEXELS];
    for (offset, weight) in BLUR.into_iter().enumerate() {
        for (i, sum) in sums.iter_mut().enumerate() {
            *sum += weight * at(offset, i);
        }
    }
    sums
}

/// Returns the index of the texel that a weight applies to, clamped to the map.
#[inline(always)]
fn shifted(i: usize, offset: usize) -> usize {
    (i + offset).saturating_sub(BLUR.len() / 2).min(CONTACT_TEXELS - 1)
}
