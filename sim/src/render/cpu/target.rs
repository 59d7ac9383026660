//! For each sample of a picture, the nearest triangle and how near it is.

use pulp::Simd;
use rapier3d::math::{Matrix, Pose, Vector};

use crate::render::camera::NEAR_M;
use crate::render::light::SAMPLES;
use crate::render::prepared::{NOTHING, Prepared};
use crate::render::raster::Outline;
use crate::render::rows::{Grid, Rows};
use crate::render::{Camera, Placed};

/// Nearest surface per sample. `nearness_1_m` is 1 / depth, which is linear over a triangle's picture.
#[derive(Default)]
pub(super) struct Target {
    grid: Grid,
    nearness_1_m: Rows<f32>,
    triangle: Rows<u32>,
}

/// Fills `samples`, [`SAMPLES`] a pixel along each axis, and `centres`, one a pixel, with all that `camera` sees.
#[inline(always)]
pub(super) fn draw<S: Simd>(
    simd: S,
    samples: &mut Target,
    centres: &mut Target,
    prepared: &Prepared,
    placed: &Placed,
    camera: &Camera,
) {
    let (width, height) = (camera.width as usize, camera.height as usize);
    samples.reset(Grid { width: width * SAMPLES, height: height * SAMPLES, pitch_px: 1.0 });
    centres.reset(Grid { width, height, pitch_px: SAMPLES as f64 });
    let camera_from_world = camera.world_from_camera.inverse();
    let focal = camera.focal_px() * SAMPLES as f32;
    let [cx, cy] = [width, height].map(|pixels| (pixels * SAMPLES) as f32 * 0.5);
    let screen = |p: Vector| {
        let nearness = -1.0 / p.z;
        [cx + p.x * focal * nearness, cy - p.y * focal * nearness, nearness]
    };
    let mut corners: Vec<(Vector, [f32; 3])> = Vec::new();
    for (number, part) in prepared.scenery.parts.iter().enumerate() {
        let camera_from_mesh = camera_from_world * placed.world_from_mesh[number];
        if !in_view(prepared.bounds[number], camera_from_mesh, cx / focal, cy / focal) {
            continue;
        }
        let rotation = Matrix::from_quat(camera_from_mesh.rotation);
        corners.clear();
        corners.extend(part.mesh.vertices.iter().map(|vertex| {
            let corner_m = rotation * vertex.position_m + camera_from_mesh.translation;
            (corner_m, screen(corner_m))
        }));
        for (number, triangle) in (prepared.first[number]..).zip(&part.mesh.triangles) {
            let corners = triangle.map(|corner| corners[corner as usize]);
            let visible = corners.map(|(corner_m, _)| corner_m.z < -NEAR_M);
            if visible == [true; 3] {
                fill(simd, samples, centres, corners.map(|(_, on_screen)| on_screen), number);
            } else if visible != [false; 3] {
                let (clipped, count) = clip_near(corners.map(|(corner_m, _)| corner_m));
                for i in 1..count - 1 {
                    fill(
                        simd,
                        samples,
                        centres,
                        [clipped[0], clipped[i], clipped[i + 1]].map(screen),
                        number,
                    );
                }
            }
        }
    }
}

#[inline(always)]
fn fill<S: Simd>(simd: S, samples: &mut Target, centres: &mut Target, corners: [[f32; 3]; 3], number: u32) {
    if let Some(outline) = Outline::new(corners) {
        samples.fill(simd, &outline, number);
        centres.fill(simd, &outline, number);
    }
}

impl Target {
    pub(super) fn width(&self) -> usize {
        self.grid.width
    }

    pub(super) fn height(&self) -> usize {
        self.grid.height
    }

    /// Of the samples of a row.
    pub(super) fn nearness_1_m(&self, row: usize) -> &[f32] {
        self.nearness_1_m.row(row)
    }

    /// Numbers of the triangles that a row shows.
    pub(super) fn triangles(&self, row: usize) -> &[u32] {
        self.triangle.row(row)
    }

    fn reset(&mut self, grid: Grid) {
        self.grid = grid;
        self.nearness_1_m.reset(grid, 0.0);
        self.triangle.reset(grid, NOTHING);
    }

    /// Puts a triangle into those samples that it is the nearest of.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, outline: &Outline, number: u32) {
        let nearest = S::as_mut_simd_f32s(self.nearness_1_m.all_mut()).0;
        let owner = S::as_mut_simd_u32s(self.triangle.all_mut()).0;
        let number = simd.splat_u32s(number);
        outline.draw(
            simd,
            self.grid,
            #[inline(always)]
            |i, nearness| {
                let nearer = simd.greater_than_f32s(nearness, nearest[i]);
                nearest[i] = simd.select_f32s(nearer, nearness, nearest[i]);
                owner[i] = simd.select_u32s(nearer, number, owner[i]);
            },
        );
    }
}

/// Whether a mesh's bounding sphere reaches into the pyramid of view, given by the tangents of its half angles.
fn in_view((centre, radius): (Vector, f32), camera_from_mesh: Pose, x_tan: f32, y_tan: f32) -> bool {
    let c = camera_from_mesh * centre;
    let inside = |across: f32, tan: f32| across.abs() + c.z * tan <= radius * (1.0 + tan * tan).sqrt();
    c.z - radius < -NEAR_M && inside(c.x, x_tan) && inside(c.y, y_tan)
}

/// The part of a triangle beyond the near plane: three or four corners.
fn clip_near(corners_m: [Vector; 3]) -> ([Vector; 4], usize) {
    let visible = |p: Vector| p.z < -NEAR_M;
    let mut kept = [Vector::ZERO; 4];
    let mut count = 0;
    for i in 0..3 {
        let (a, b) = (corners_m[i], corners_m[(i + 1) % 3]);
        if visible(a) {
            kept[count] = a;
            count += 1;
        }
        if visible(a) != visible(b) {
            // Always from the visible end, so that neighbours cut their common edge at the same point.
            let (from, to) = if visible(a) { (a, b) } else { (b, a) };
            kept[count] = from + (to - from) * ((-NEAR_M - from.z) / (to.z - from.z));
            // Rounding must not put the corner back in front of the plane.
            kept[count].z = -NEAR_M;
            count += 1;
        }
    }
    (kept, count)
}
