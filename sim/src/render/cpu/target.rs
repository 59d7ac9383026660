//! The render target: for each sample of an image, the nearest patch and its nearness.

use pulp::Simd;
use rapier3d::math::{Pose, Vector};

use super::raster::{Grid, Outlines, SampleRows, TriangleBatch};
use crate::render::scene::camera::NEAR_M;
use crate::render::scene::prepared::{NOTHING, Prepared};
use crate::render::shading::SAMPLES;
use crate::render::shading::lanes::{Affine, Lanes, lanes};
use crate::render::{Camera, PlacedScenery};

/// Nearest surface per sample. `nearness_1_m` is 1 / depth, which is linear over a triangle's image.
#[derive(Default)]
pub(super) struct RenderTarget {
    grid: Grid,
    nearness_1_m: SampleRows<f32>,
    patch: SampleRows<u32>,
}

/// Draws the camera's view into `samples`, with [`SAMPLES`] per pixel along each axis, and into `centres`, if
/// given, with one sample per pixel.
#[inline(always)]
pub(super) fn draw<S: Simd>(
    simd: S,
    samples: &mut RenderTarget,
    mut centres: Option<&mut RenderTarget>,
    prepared: &Prepared,
    placed: &PlacedScenery,
    camera: &Camera,
) {
    let (width, height) = (camera.width as usize, camera.height as usize);
    samples.reset(Grid { width: width * SAMPLES, height: height * SAMPLES, pitch_px: 1.0 });
    if let Some(centres) = &mut centres {
        centres.reset(Grid { width, height, pitch_px: SAMPLES as f64 });
    }
    project(
        prepared,
        placed,
        camera,
        #[inline(always)]
        |part| !prepared.is_veil[part],
        #[inline(always)]
        |outlines| fill(simd, samples, centres.as_deref_mut(), outlines),
    );
}

/// Fills `samples` with the nearness of shadow casters, as seen by a lamp at the camera's pose.
#[inline(always)]
pub(super) fn draw_casting<S: Simd>(
    simd: S,
    samples: &mut RenderTarget,
    prepared: &Prepared,
    placed: &PlacedScenery,
    camera: &Camera,
) {
    let (width, height) = (camera.width as usize * SAMPLES, camera.height as usize * SAMPLES);
    samples.reset(Grid { width, height, pitch_px: 1.0 });
    project(
        prepared,
        placed,
        camera,
        #[inline(always)]
        |part| prepared.scenery.parts[part].casts_shadow,
        #[inline(always)]
        |outlines| samples.fill(simd, outlines),
    );
}

/// Fills `layer` with the nearest blended surfaces in front of the solid ones and, if given, behind the
/// previous layer. Returns false if there are none.
#[inline(always)]
pub(super) fn draw_veils<S: Simd>(
    simd: S,
    layer: &mut RenderTarget,
    solid: &RenderTarget,
    before: Option<&RenderTarget>,
    prepared: &Prepared,
    placed: &PlacedScenery,
    camera: &Camera,
) -> bool {
    layer.reset(solid.grid);
    project(
        prepared,
        placed,
        camera,
        #[inline(always)]
        |part| prepared.is_veil[part],
        #[inline(always)]
        |outlines| layer.fill_between(simd, outlines, solid, before),
    );
    layer.nearness_1_m.all_mut().iter().any(|nearness| *nearness > 0.0)
}

/// Calls `each` for the triangles of some parts, in batches.
#[inline(always)]
fn project(
    prepared: &Prepared,
    placed: &PlacedScenery,
    camera: &Camera,
    is_drawn: impl Fn(usize) -> bool,
    mut each: impl FnMut(&Outlines),
) {
    let camera_from_world = camera.world_from_camera.inverse();
    let lens = Lens::new(camera);
    let (mut corners, mut front): (Vec<[f32; 4]>, _) = (Vec::new(), Vec::new());
    let mut batch = TriangleBatch::default();
    for (number, part) in prepared.scenery.parts.iter().enumerate() {
        let camera_from_mesh = camera_from_world * placed.world_from_mesh[number];
        let geometry = prepared.geometry(number);
        if !is_drawn(number) || !lens.sees(geometry.bounds, camera_from_mesh) {
            continue;
        }
        let map = Affine::of(camera_from_mesh);
        geometry.points.map_into(&mut corners, |block| {
            let [x, y, z] = map.map_lanes(block);
            let nearness: Lanes = lanes(|i| -1.0 / z[i]);
            let ([cx, cy], focal) = (lens.centre_px, lens.focal_px);
            let column = lanes(|i| cx + x[i] * focal * nearness[i]);
            let row = lanes(|i| cy - y[i] * focal * nearness[i]);
            [column, row, nearness, z]
        });
        let (patches, triangles) = (prepared.patches_of(number), &geometry.triangles);
        let eye_m = camera_from_mesh.inverse().translation;
        geometry.faces.put_front(&mut front, [eye_m.x, eye_m.y, eye_m.z, 1.0]);
        for number in &front {
            let (patch, triangle) = (patches[*number as usize], triangles[*number as usize]);
            let [a, b, c] = triangle.map(|corner| corners[corner as usize]);
            let visible = [a, b, c].map(|[_, _, _, z]| u32::from(z < -NEAR_M)).into_iter().sum::<u32>();
            if visible == 3 {
                batch.push([a, b, c].map(|[u, v, nearness, _]| [u, v, nearness]), patch);
            } else if visible > 0 {
                let corners_m = part.mesh.triangles[*number as usize]
                    .map(|corner| map.map(part.mesh.vertices[corner as usize].position_m));
                let (clipped, count) = clip_near(corners_m.map(Vector::from));
                for i in 1..count - 1 {
                    let corners = [clipped[0], clipped[i], clipped[i + 1]];
                    if batch.is_full() {
                        each(&batch.take());
                    }
                    batch.push(corners.map(|p| lens.screen(p.to_array())), patch);
                }
            }
            if batch.is_full() {
                each(&batch.take());
            }
        }
    }
    each(&batch.take());
}

/// Projection of a camera's frame to the image's samples.
struct Lens {
    focal_px: f32,
    centre_px: [f32; 2],
}

impl Lens {
    fn new(camera: &Camera) -> Lens {
        let [width, height] = [camera.width, camera.height].map(|pixels| (pixels as usize * SAMPLES) as f32);
        Lens { focal_px: camera.focal_px() * SAMPLES as f32, centre_px: [width * 0.5, height * 0.5] }
    }

    /// Returns column, row and nearness of a point.
    #[inline(always)]
    fn screen(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let nearness = -1.0 / z;
        let [cx, cy] = self.centre_px;
        [cx + x * self.focal_px * nearness, cy - y * self.focal_px * nearness, nearness]
    }

    /// Returns true if a mesh's bounding sphere reaches into the view frustum.
    fn sees(&self, (centre, radius): (Vector, f32), camera_from_mesh: Pose) -> bool {
        let c = camera_from_mesh * centre;
        let inside = |across: f32, half: f32| {
            let tan = half / self.focal_px;
            across.abs() + c.z * tan <= radius * (1.0 + tan * tan).sqrt()
        };
        c.z - radius < -NEAR_M && inside(c.x, self.centre_px[0]) && inside(c.y, self.centre_px[1])
    }
}

#[inline(always)]
fn fill<S: Simd>(
    simd: S,
    samples: &mut RenderTarget,
    centres: Option<&mut RenderTarget>,
    outlines: &Outlines,
) {
    samples.fill(simd, outlines);
    if let Some(centres) = centres {
        centres.fill(simd, outlines);
    }
}

impl RenderTarget {
    pub(super) fn width(&self) -> usize {
        self.grid.width
    }

    pub(super) fn height(&self) -> usize {
        self.grid.height
    }

    /// Returns the nearness of the samples of a row.
    #[inline(always)]
    pub(super) fn nearness_1_m(&self, row: usize) -> &[f32] {
        self.nearness_1_m.row(row)
    }

    /// Returns the patch indices that a finished row shows.
    #[inline(always)]
    pub(super) fn patches(&self, row: usize) -> &[u32] {
        self.patch.row(row)
    }

    fn reset(&mut self, grid: Grid) {
        self.grid = grid;
        self.nearness_1_m.reset(grid, 0.0);
        self.patch.fit(grid, NOTHING);
    }

    /// Clears the patch indices of a row where nothing was drawn, which still hold values of other images.
    /// Few rows have such samples, so this is faster than clearing all indices at first.
    #[inline(always)]
    pub(super) fn finish_row(&mut self, row: usize) {
        let nearness_1_m = self.nearness_1_m.row(row);
        if nearness_1_m.iter().fold(false, |any, nearness| any | (*nearness == 0.0)) {
            for (patch, nearness) in self.patch.row_mut(row).iter_mut().zip(nearness_1_m) {
                *patch = if *nearness == 0.0 { NOTHING } else { *patch };
            }
        }
    }

    /// Draws triangles, tagged with their patches, into those samples for which they are the nearest.
    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, outlines: &Outlines) {
        let nearest = S::as_mut_simd_f32s(self.nearness_1_m.all_mut()).0;
        let owner = S::as_mut_simd_u32s(self.patch.all_mut()).0;
        let nothing = simd.splat_u32s(0);
        outlines.draw(
            simd,
            self.grid,
            #[inline(always)]
            |i, patch, nearness| {
                let nearer = simd.greater_than_f32s(nearness, nearest[i]);
                nearest[i] = simd.max_f32s(nearness, nearest[i]);
                // A selection would be compiled to a masked store, which takes some processors 20 ns.
                let change =
                    simd.select_u32s(nearer, simd.xor_u32s(owner[i], simd.splat_u32s(patch)), nothing);
                owner[i] = simd.xor_u32s(owner[i], change);
            },
        );
    }

    /// Draws triangles into those samples for which they are the nearest in front of `solid` and behind
    /// `before`.
    #[inline(always)]
    fn fill_between<S: Simd>(
        &mut self,
        simd: S,
        outlines: &Outlines,
        solid: &RenderTarget,
        before: Option<&RenderTarget>,
    ) {
        let nearest = S::as_mut_simd_f32s(self.nearness_1_m.all_mut()).0;
        let owner = S::as_mut_simd_u32s(self.patch.all_mut()).0;
        let behind = S::as_simd_f32s(solid.nearness_1_m.all()).0;
        let front = before.map(|before| S::as_simd_f32s(before.nearness_1_m.all()).0);
        let (nothing, none) = (simd.splat_u32s(0), simd.splat_f32s(0.0));
        outlines.draw(
            simd,
            self.grid,
            #[inline(always)]
            |i, patch, nearness| {
                let in_front = simd.greater_than_f32s(nearness, behind[i]);
                let mut nearness = simd.select_f32s(in_front, nearness, none);
                if let Some(front) = front {
                    nearness = simd.select_f32s(simd.less_than_f32s(nearness, front[i]), nearness, none);
                }
                let nearer = simd.greater_than_f32s(nearness, nearest[i]);
                nearest[i] = simd.max_f32s(nearness, nearest[i]);
                let change =
                    simd.select_u32s(nearer, simd.xor_u32s(owner[i], simd.splat_u32s(patch)), nothing);
                owner[i] = simd.xor_u32s(owner[i], change);
            },
        );
    }
}

/// Returns the part of a triangle beyond the near plane: three or four corners.
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
            // Cutting from the visible end gives neighbours the same point on their common edge.
            let (from, to) = if visible(a) { (a, b) } else { (b, a) };
            kept[count] = from + (to - from) * ((-NEAR_M - from.z) / (to.z - from.z));
            // Rounding must not put the corner back in front of the plane.
            kept[count].z = -NEAR_M;
            count += 1;
        }
    }
    (kept, count)
}
