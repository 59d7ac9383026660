//! Shadow of the sun around the focus.

use std::f32::consts::SQRT_2;

use pulp::Simd;
use rapier3d::math::Vector;

use crate::render::Placed;
use crate::render::light::{BIAS_M, NORMAL_OFFSET_M, SunMap, TEXELS, TO_SUN, sun_map};
use crate::render::prepared::Prepared;
use crate::render::raster::Outline;
use crate::render::rows::{Grid, LANES, Rows};

/// Texels along each side of a cell: what is nearer than all of a cell is in the sun there, without a look at its texels.
const CELL: usize = LANES;

#[derive(Default)]
pub(super) struct ShadowMap {
    /// "Nearness" here is [`DISTANCE_M`] minus the distance from the sun's plane, and grows towards the sun.
    nearness_m: Rows<f32>,
    /// Least and greatest nearness of each cell, row by row.
    cells_m: Vec<[f32; 2]>,
    map_from_world: SunMap,
}

impl ShadowMap {
    /// Draws the shadows of everything that casts one.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(&mut self, simd: S, prepared: &Prepared, placed: &Placed) {
        let radius_m = prepared.scenery.focus_radius_m;
        self.map_from_world = sun_map(placed.focus_m, radius_m);
        let grid = Grid { width: TEXELS, height: TEXELS, pitch_px: 1.0 };
        self.nearness_m.reset(grid, 0.0);
        let nearest = S::as_mut_simd_f32s(self.nearness_m.all_mut()).0;
        let mut corners = Vec::new();
        let parts = prepared.scenery.parts.iter().zip(&placed.world_from_mesh).zip(&prepared.bounds);
        for ((part, world_from_mesh), (centre_m, around_m)) in
            parts.filter(|((part, _), _)| part.casts_shadow)
        {
            let from_focus_m = *world_from_mesh * *centre_m - placed.focus_m;
            if from_focus_m.reject_from_normalized(TO_SUN).length() > radius_m * SQRT_2 + around_m {
                continue;
            }
            let to_mesh = world_from_mesh.rotation.inverse();
            let map_from_mesh = self
                .map_from_world
                .map(|(axis, constant)| (to_mesh * axis, constant + axis.dot(world_from_mesh.translation)));
            corners.clear();
            corners.extend(part.mesh.vertices.iter().map(|vertex| place(map_from_mesh, vertex.position_m)));
            for triangle in &part.mesh.triangles {
                if let Some(outline) = Outline::new(triangle.map(|corner| corners[corner as usize])) {
                    outline.draw(
                        simd,
                        grid,
                        #[inline(always)]
                        |i, nearness_m| nearest[i] = simd.max_f32s(nearest[i], nearness_m),
                    );
                }
            }
        }
        self.measure_cells();
    }

    #[inline(always)]
    fn measure_cells(&mut self) {
        self.cells_m.clear();
        for top in (0..TEXELS).step_by(CELL) {
            let mut least = [[f32::INFINITY; LANES]; TEXELS / LANES];
            let mut greatest = [[0.0f32; LANES]; TEXELS / LANES];
            for row in top..top + CELL {
                let blocks = self.nearness_m.row(row).as_chunks::<LANES>().0.iter();
                for ((block, least), greatest) in blocks.zip(&mut least).zip(&mut greatest) {
                    for i in 0..LANES {
                        least[i] = if block[i] < least[i] { block[i] } else { least[i] };
                        greatest[i] = if block[i] > greatest[i] { block[i] } else { greatest[i] };
                    }
                }
            }
            self.cells_m.extend(least.iter().zip(&greatest).map(|(least, greatest)| {
                [
                    least.iter().copied().fold(f32::INFINITY, f32::min),
                    greatest.iter().copied().fold(0.0, f32::max),
                ]
            }));
        }
    }

    /// Where a surface is looked up: column and row, counted from the first texel's centre, and nearness.
    #[inline(always)]
    pub(super) fn texel(&self, point_m: Vector, normal: Vector) -> Vector {
        let [u, v, nearness_m] = place(self.map_from_world, point_m + normal * NORMAL_OFFSET_M);
        Vector::new(u - 0.5, v - 0.5, nearness_m + BIAS_M)
    }

    /// 1 in the sun, 0 in the shadow, smooth over three texels; points outside the map are in the sun.
    #[inline(always)]
    pub(super) fn sunlit(&self, texel_values: Vector) -> f32 {
        let [u, v, nearness_m] = texel_values.to_array();
        let inside = |i: f32| i >= 1.0 && i < (TEXELS - 3) as f32;
        if !inside(u) || !inside(v) {
            return 1.0;
        }
        let (column, row) = (usize::from(u as u16), usize::from(v as u16));
        match self.cells(column, row) {
            [_, greatest_m] if nearness_m >= greatest_m => 1.0,
            [least_m, _] if nearness_m < least_m => 0.0,
            _ => self.filtered(texel_values),
        }
    }

    /// Least and greatest nearness around a texel, at least as far as the filter reaches.
    fn cells(&self, column: usize, row: usize) -> [f32; 2] {
        let mut both = [f32::INFINITY, 0.0];
        for y in [(row - 1) / CELL, (row + 2) / CELL] {
            for x in [(column - 1) / CELL, (column + 2) / CELL] {
                let [least, greatest] = self.cells_m[y * (TEXELS / CELL) + x];
                both = [both[0].min(least), both[1].max(greatest)];
            }
        }
        both
    }

    /// Four taps with a tent's weights along each axis are a bilinear filter three texels wide.
    fn filtered(&self, texel_values: Vector) -> f32 {
        let [u, v, nearness_m] = texel_values.to_array();
        let (column, row) = (usize::from(u as u16), usize::from(v as u16));
        let weights = |part: f32| [1.0 - part, 1.0, 1.0, part];
        let (across, down) = (weights(u - column as f32), weights(v - row as f32));
        let mut columns = [0.0; 4];
        for (j, weight) in down.into_iter().enumerate() {
            let occluders = &self.nearness_m.row(row - 1 + j)[column - 1..column + 3];
            for (sum, occluder) in columns.iter_mut().zip(occluders) {
                *sum += if nearness_m >= *occluder { weight } else { 0.0 };
            }
        }
        let sum: f32 = columns.into_iter().zip(across).map(|(sum, weight)| sum * weight).sum();
        sum / 9.0
    }
}

/// Where a point is on the map: column and row, counted from its corner, and nearness.
#[inline(always)]
fn place(map: SunMap, point_m: Vector) -> [f32; 3] {
    map.map(|(axis, constant)| axis.dot(point_m) + constant)
}
