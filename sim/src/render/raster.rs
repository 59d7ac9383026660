//! Rasteriser: a visibility buffer of triangle numbers, shaded afterwards, four samples a pixel.

use rapier3d::math::{Pose, Vector};

use super::camera::NEAR_M;
use super::shade::{SKY, SrgbTable, albedo, linear, shade};
use super::shadow::ShadowMap;
use super::{Camera, Frame, Mesh, RenderScene};

/// Samples a pixel along each axis.
const SAMPLES: usize = 2;
/// Marks a sample at which nothing is.
const NOTHING: u32 = u32::MAX;
/// How much the outline between two things darkens.
const OUTLINE: f32 = 0.45;
/// Two things are outlined where their depths differ by more than this part: not where they touch.
const OUTLINE_DEPTH_STEP: f32 = 0.02;

/// Renders on the calling thread. It keeps its buffers, and the shadows of the last scene.
pub struct CpuRenderer {
    target: Target,
    /// One sample a pixel, at its centre: what depth and ids are read from.
    centres: Target,
    shadow: ShadowMap,
    srgb: SrgbTable,
}

/// Nearest surface per sample. `nearness` is 1 / depth, which is linear over a triangle's picture.
#[derive(Default)]
pub(super) struct Target {
    pub width: usize,
    pub height: usize,
    pub nearness: Vec<f32>,
    pub triangle: Vec<u32>,
}

impl Default for CpuRenderer {
    fn default() -> Self {
        CpuRenderer {
            target: Target::default(),
            centres: Target::default(),
            shadow: ShadowMap::default(),
            srgb: SrgbTable::new(),
        }
    }
}

impl CpuRenderer {
    /// Draws `scene` as `camera` sees it.
    pub fn render(&mut self, scene: &RenderScene, camera: &Camera) -> Frame {
        self.shadow.update(scene);
        self.target.reset(camera.width as usize * SAMPLES, camera.height as usize * SAMPLES);
        self.centres.reset(camera.width as usize, camera.height as usize);
        draw_instances(&mut self.centres, scene, camera, 1.0);
        let owners = draw_instances(&mut self.target, scene, camera, SAMPLES as f32);
        let view = View::new(scene, camera, &self.target, owners);
        let pixels = (camera.width * camera.height) as usize;
        let mut frame = Frame {
            width: camera.width,
            height: camera.height,
            rgb: Vec::with_capacity(pixels * 3),
            depth_m: Vec::with_capacity(pixels),
            ids: Vec::with_capacity(pixels),
        };
        for y in 0..camera.height as usize {
            for x in 0..camera.width as usize {
                let colour = view.pixel(x, y, &self.shadow);
                frame.rgb.extend(self.srgb.encode(colour));
            }
        }
        frame.depth_m.extend(self.centres.nearness.iter().map(|nearness| 1.0 / nearness));
        frame.ids.extend(self.centres.triangle.iter().map(|triangle| view.id(*triangle)));
        frame
    }
}

/// Fills `target` with everything in view; returns the first triangle number of each instance.
fn draw_instances(target: &mut Target, scene: &RenderScene, camera: &Camera, samples: f32) -> Vec<u32> {
    let camera_from_world = camera.world_from_camera.inverse();
    let focal = camera.focal_px() * samples;
    let (cx, cy) = (target.width as f32 * 0.5, target.height as f32 * 0.5);
    let screen = |p: Vector| {
        let nearness = -1.0 / p.z;
        [cx + p.x * focal * nearness, cy - p.y * focal * nearness, nearness]
    };
    let mut first = Vec::with_capacity(scene.instances.len());
    let mut next = 0;
    let mut corners = Vec::new();
    for instance in &scene.instances {
        first.push(next);
        let mesh = &scene.meshes[instance.mesh];
        let number = next;
        next += mesh.triangles.len() as u32;
        let camera_from_mesh = camera_from_world * instance.world_from_mesh;
        if !in_view(mesh, camera_from_mesh, cx / focal, cy / focal) {
            continue;
        }
        corners.clear();
        corners.extend(mesh.vertices.iter().map(|vertex| camera_from_mesh * vertex.position_m));
        for (index, triangle) in mesh.triangles.iter().enumerate() {
            let p = triangle.map(|corner| corners[corner as usize]);
            let number = number + index as u32;
            if p.iter().all(|p| p.z < -NEAR_M) {
                target.fill(p.map(screen), number);
            } else if p.iter().any(|p| p.z < -NEAR_M) {
                let (clipped, count) = clip_near(p);
                for i in 1..count - 1 {
                    target.fill([clipped[0], clipped[i], clipped[i + 1]].map(screen), number);
                }
            }
        }
    }
    first
}

/// Whether a mesh's bounding sphere reaches into the pyramid of view, given by the tangents of its half angles.
fn in_view(mesh: &Mesh, camera_from_mesh: Pose, tan_x: f32, tan_y: f32) -> bool {
    let (centre, radius) = mesh.bounds();
    let c = camera_from_mesh * centre;
    let inside = |across: f32, tan: f32| across.abs() + c.z * tan <= radius * (1.0 + tan * tan).sqrt();
    c.z - radius < -NEAR_M && inside(c.x, tan_x) && inside(c.y, tan_y)
}

/// The part of a triangle beyond the near plane: three or four corners.
fn clip_near(p: [Vector; 3]) -> ([Vector; 4], usize) {
    let mut kept = [Vector::ZERO; 4];
    let mut count = 0;
    for i in 0..3 {
        let (a, b) = (p[i], p[(i + 1) % 3]);
        if a.z < -NEAR_M {
            kept[count] = a;
            count += 1;
        }
        if (a.z < -NEAR_M) != (b.z < -NEAR_M) {
            kept[count] = a + (b - a) * ((-NEAR_M - a.z) / (b.z - a.z));
            // Rounding must not put the corner back in front of the plane.
            kept[count].z = -NEAR_M;
            count += 1;
        }
    }
    (kept, count)
}

impl Target {
    pub(super) fn reset(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.nearness.clear();
        self.nearness.resize(width * height, 0.0);
        self.triangle.clear();
        self.triangle.resize(width * height, NOTHING);
    }

    /// Fills a triangle given by picture coordinates and nearness. Back faces are left out.
    ///
    /// Nearness is set up in f64: a floor triangle clipped at the near plane has corners 1e4 pixels off the picture,
    /// and f32 gradients would err by centimetres.
    pub(super) fn fill(&mut self, [a, b, c]: [[f32; 3]; 3], number: u32) {
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if area >= 0.0 || !area.is_finite() {
            return;
        }
        let low = |axis: usize| (a[axis].min(b[axis]).min(c[axis]) - 0.5).ceil().max(0.0);
        let high = |axis: usize, size: usize| (a[axis].max(b[axis]).max(c[axis]) - 0.5).floor().min(size as f32 - 1.0);
        let (x0, x1, y0, y1) = (low(0), high(0, self.width), low(1), high(1, self.height));
        if x0 > x1 || y0 > y1 {
            return;
        }
        let [[ax, ay, an], [bx, by, bn], [cx, cy, cn]] = [a, b, c].map(|p| p.map(f64::from));
        let (ux, uy, un, vx, vy, vn) = (bx - ax, by - ay, bn - an, cx - ax, cy - ay, cn - an);
        let scale = 1.0 / (ux * vy - vx * uy);
        let along_x = (un * vy - vn * uy) * scale;
        let along_y = (vn * ux - un * vx) * scale;
        // Inside where every edge function is not negative; the sign turns clockwise triangles round.
        let edge = |p: [f32; 3], q: [f32; 3]| {
            let (ex, ey) = (q[1] - p[1], p[0] - q[0]);
            [ex, ey, -ex * p[0] - ey * p[1]]
        };
        let edges = [edge(a, b), edge(b, c), edge(c, a)];
        for row in y0 as usize..=y1 as usize {
            let y = row as f32 + 0.5;
            let (mut left, mut right) = (x0, x1);
            for [ex, ey, e0] in edges {
                let rest = ey * y + e0;
                if ex > 0.0 {
                    left = left.max((-rest / ex - 0.5).ceil());
                } else if ex < 0.0 {
                    right = right.min((-rest / ex - 0.5).floor());
                } else if rest < 0.0 {
                    right = -1.0;
                }
            }
            if left > right {
                continue;
            }
            let (left, right) = (left as usize, right as usize);
            let start = an + along_x * (left as f64 + 0.5 - ax) + along_y * (f64::from(y) - ay);
            let (start, step) = (start as f32, along_x as f32);
            let span = row * self.width + left..=row * self.width + right;
            let samples = self.nearness[span.clone()].iter_mut().zip(&mut self.triangle[span]);
            for (i, (nearest, owner)) in samples.enumerate() {
                let nearness = start + step * i as f32;
                if nearness > *nearest {
                    *nearest = nearness;
                    *owner = number;
                }
            }
        }
    }
}

/// A filled target, ready to be shaded.
struct View<'a> {
    scene: &'a RenderScene,
    camera: &'a Camera,
    target: &'a Target,
    first: Vec<u32>,
    linear_rgb: Vec<Vector>,
}

impl<'a> View<'a> {
    fn new(scene: &'a RenderScene, camera: &'a Camera, target: &'a Target, first: Vec<u32>) -> View<'a> {
        let linear_rgb = scene.instances.iter().map(|instance| linear(instance.rgb)).collect();
        View { scene, camera, target, first, linear_rgb }
    }

    /// Instance that a triangle belongs to.
    fn owner(&self, triangle: u32) -> usize {
        self.first.partition_point(|first| *first <= triangle) - 1
    }

    fn id(&self, triangle: u32) -> u32 {
        if triangle == NOTHING { 0 } else { self.scene.instances[self.owner(triangle)].id }
    }

    /// Mean linear colour of a pixel's samples; a triangle that covers several is shaded once.
    fn pixel(&self, x: usize, y: usize, shadow: &ShadowMap) -> Vector {
        let mut shaded: [(u32, Vector); SAMPLES * SAMPLES] = [(0, Vector::ZERO); SAMPLES * SAMPLES];
        let mut count = 0;
        let mut sum = Vector::ZERO;
        let mut edges = 0;
        for i in 0..SAMPLES * SAMPLES {
            let (sx, sy) = (x * SAMPLES + i % SAMPLES, y * SAMPLES + i / SAMPLES);
            let sample = sy * self.target.width + sx;
            let triangle = self.target.triangle[sample];
            edges += self.outlines(sx, sy);
            sum += match shaded[..count].iter().find(|(known, _)| *known == triangle) {
                Some((_, colour)) => *colour,
                None => {
                    let colour = if triangle == NOTHING { SKY } else { self.surface(sx, sy, triangle, shadow) };
                    shaded[count] = (triangle, colour);
                    count += 1;
                    colour
                }
            };
        }
        let outline = (edges as f32 / (2 * SAMPLES) as f32).min(1.0);
        sum * ((1.0 - OUTLINE * outline) / (SAMPLES * SAMPLES) as f32)
    }

    /// How many of the neighbours to the right and below belong to another thing at another depth.
    fn outlines(&self, sx: usize, sy: usize) -> u32 {
        if sx + 1 >= self.target.width || sy + 1 >= self.target.height {
            return 0;
        }
        let here = sy * self.target.width + sx;
        let differs = |there: usize| {
            let (a, b) = (self.target.triangle[here], self.target.triangle[there]);
            if a == b || a == NOTHING || b == NOTHING || self.id(a) == self.id(b) {
                return false;
            }
            let (near_a, near_b) = (self.target.nearness[here], self.target.nearness[there]);
            (near_a - near_b).abs() > OUTLINE_DEPTH_STEP * near_a.max(near_b)
        };
        u32::from(differs(here + 1)) + u32::from(differs(here + self.target.width))
    }

    fn surface(&self, sx: usize, sy: usize, triangle: u32, shadow: &ShadowMap) -> Vector {
        let owner = self.owner(triangle);
        let instance = &self.scene.instances[owner];
        let uv = [(sx as f32 + 0.5) / SAMPLES as f32, (sy as f32 + 0.5) / SAMPLES as f32];
        let depth_m = 1.0 / self.target.nearness[sy * self.target.width + sx];
        let eye_m = self.camera.world_from_camera.translation;
        let point_m = self.camera.world_from_camera * self.camera.unproject(uv, depth_m);
        let mesh = &self.scene.meshes[instance.mesh];
        let corners = mesh.triangles[(triangle - self.first[owner]) as usize].map(|corner| mesh.vertices[corner as usize]);
        let local = instance.world_from_mesh.inverse() * point_m;
        let [a, b, c] = corners.map(|corner| corner.position_m);
        let face = (b - a).cross(c - a);
        let scale = 1.0 / face.length_squared();
        let weight_b = (local - a).cross(c - a).dot(face) * scale;
        let weight_c = (b - a).cross(local - a).dot(face) * scale;
        let [na, nb, nc] = corners.map(|corner| corner.normal);
        let normal = na * (1.0 - weight_b - weight_c) + nb * weight_b + nc * weight_c;
        let normal = (instance.world_from_mesh.rotation * normal).normalize();
        let colour = albedo(instance, self.linear_rgb[owner], point_m);
        shade(colour, point_m, normal, eye_m, shadow.sunlit(point_m, normal))
    }
}
