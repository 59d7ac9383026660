//! Rasteriser: for each sample of a picture, the nearest triangle and how near it is.

use std::ops::Range;

use rapier3d::math::{Pose, Vector};

use super::prepared::Prepared;
use crate::render::camera::NEAR_M;
use crate::render::{Camera, Placed};

/// Samples a pixel along each axis; a power of two, so that dividing by it is exact.
pub(super) const SAMPLES: usize = 2;
/// Marks a sample at which nothing is.
pub(super) const NOTHING: u32 = u32::MAX;

/// Nearest surface per sample. `nearness_1_m` is 1 / depth, which is linear over a triangle's picture.
#[derive(Default)]
pub(super) struct Target {
    pub width: usize,
    pub height: usize,
    pub nearness_1_m: Vec<f32>,
    pub triangle: Vec<u32>,
}

impl Target {
    /// Fills the target, [`SAMPLES`] a pixel along each axis, and `centres`, one a pixel, with all that `camera` sees.
    pub(super) fn draw(
        &mut self,
        centres: &mut Target,
        prepared: &Prepared,
        placed: &Placed,
        camera: &Camera,
    ) {
        let (width, height) = (camera.width as usize, camera.height as usize);
        self.reset(width * SAMPLES, height * SAMPLES);
        centres.reset(width, height);
        let mut fill = |corners: [[f32; 3]; 3], number: u32| {
            self.fill(corners, number);
            let centred = |[x, y, nearness]: [f32; 3]| [x / SAMPLES as f32, y / SAMPLES as f32, nearness];
            centres.fill(corners.map(centred), number);
        };
        let camera_from_world = camera.world_from_camera.inverse();
        let focal = camera.focal_px() * SAMPLES as f32;
        let [cx, cy] = [width, height].map(|pixels| (pixels * SAMPLES) as f32 * 0.5);
        let screen = |p: Vector| {
            let nearness = -1.0 / p.z;
            [cx + p.x * focal * nearness, cy - p.y * focal * nearness, nearness]
        };
        let mut corners = Vec::new();
        for (number, part) in prepared.scenery.parts.iter().enumerate() {
            let camera_from_mesh = camera_from_world * placed.world_from_mesh[number];
            if !in_view(prepared.bounds[number], camera_from_mesh, cx / focal, cy / focal) {
                continue;
            }
            corners.clear();
            corners.extend(part.mesh.vertices.iter().map(|vertex| camera_from_mesh * vertex.position_m));
            for (number, triangle) in (prepared.first[number]..).zip(&part.mesh.triangles) {
                let p = triangle.map(|corner| corners[corner as usize]);
                if p.iter().all(|p| p.z < -NEAR_M) {
                    fill(p.map(screen), number);
                } else if p.iter().any(|p| p.z < -NEAR_M) {
                    let (clipped, count) = clip_near(p);
                    for i in 1..count - 1 {
                        fill([clipped[0], clipped[i], clipped[i + 1]].map(screen), number);
                    }
                }
            }
        }
    }

    fn reset(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.nearness_1_m.clear();
        self.nearness_1_m.resize(width * height, 0.0);
        self.triangle.clear();
        self.triangle.resize(width * height, NOTHING);
    }

    fn fill(&mut self, corners: [[f32; 3]; 3], number: u32) {
        for_spans(corners, self.width, self.height, |span, start, step| {
            nearest(&mut self.nearness_1_m[span.clone()], &mut self.triangle[span], start, step, number);
        });
    }
}

/// Puts a triangle into those samples of a row that it is the nearest of. Nothing branches, and the slices are arguments,
/// known not to overlap: so several samples are done at once.
fn nearest(nearness_1_m: &mut [f32], triangle: &mut [u32], start_1_m: f32, step_1_m: f32, number: u32) {
    for (i, (nearest, owner)) in nearness_1_m.iter_mut().zip(triangle).enumerate() {
        let nearness = start_1_m + step_1_m * i as i32 as f32;
        // All bits of it are set, or none.
        let nearer = u32::from(nearness > *nearest).wrapping_neg();
        *nearest = nearest.max(nearness);
        *owner = (number & nearer) | (*owner & !nearer);
    }
}

/// Calls `fill` for each row of samples in a triangle, which is given by picture coordinates and nearness, with their
/// indices, the nearness of the first and the step to the next. Back faces are left out.
///
/// Everything but the samples is f64: a floor triangle clipped at the near plane has corners 1e4 pixels off the
/// picture, and f32 gradients would err by centimetres. In f64 the edge that two triangles share also comes out
/// the same for both, to the bit, and leaves no gap.
pub(super) fn for_spans(
    corners: [[f32; 3]; 3],
    width: usize,
    height: usize,
    mut fill: impl FnMut(Range<usize>, f32, f32),
) {
    let [[ax, ay, an], [bx, by, bn], [cx, cy, cn]] = corners.map(|p| p.map(f64::from));
    let (ux, uy, un, vx, vy, vn) = (bx - ax, by - ay, bn - an, cx - ax, cy - ay, cn - an);
    // Rows count downwards, so that what is counter-clockwise has a negative area.
    let area = ux * vy - uy * vx;
    if area >= 0.0 || !area.is_finite() {
        return;
    }
    let x0 = ceil(ax.min(bx).min(cx) - 0.5).max(0);
    let x1 = floor(ax.max(bx).max(cx) - 0.5).min(width as i32 - 1);
    let y0 = ceil(ay.min(by).min(cy) - 0.5).max(0);
    let y1 = floor(ay.max(by).max(cy) - 0.5).min(height as i32 - 1);
    if x0 > x1 || y0 > y1 {
        return;
    }
    let along_x = (un * vy - vn * uy) / area;
    let along_y = (vn * ux - un * vx) / area;
    // Inside where x * ex + y * ey + e0 >= 0 for all three edges.
    let edge = |px: f64, py: f64, qx: f64, qy: f64| {
        let ex = qy - py;
        (ex, 1.0 / ex, px - qx, qx * py - px * qy)
    };
    let edges = [edge(ax, ay, bx, by), edge(bx, by, cx, cy), edge(cx, cy, ax, ay)];
    for row in y0..=y1 {
        let y = f64::from(row) + 0.5;
        // Compared as they are: both are rounded once, not for each edge.
        let (mut from, mut to) = (f64::from(x0), f64::from(x1));
        for (ex, per_ex, ey, e0) in edges {
            let rest = ey * y + e0;
            let x = -rest * per_ex - 0.5;
            if ex > 0.0 {
                from = if x > from { x } else { from };
            } else if ex < 0.0 {
                to = if x < to { x } else { to };
            } else if rest < 0.0 {
                to = -1.0;
            }
        }
        let (left, right) = (ceil(from), floor(to));
        if left > right {
            continue;
        }
        let start = an + along_x * (f64::from(left) + 0.5 - ax) + along_y * (y - ay);
        let line = row as usize * width;
        fill(line + left as usize..line + right as usize + 1, start as f32, along_x as f32);
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

/// As `f64::floor`, which without SSE 4.1 is a call; clamped to the range of `i32`.
pub(super) fn floor(value: f64) -> i32 {
    let truncated = value as i32;
    if f64::from(truncated) > value { truncated.saturating_sub(1) } else { truncated }
}

fn ceil(value: f64) -> i32 {
    let truncated = value as i32;
    if f64::from(truncated) < value { truncated.saturating_add(1) } else { truncated }
}
