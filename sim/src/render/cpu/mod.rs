//! The embedded renderer: a visibility buffer of triangle numbers, shaded afterwards, four samples a pixel.

mod raster;
mod shade;
mod shadow;

use rapier3d::math::{Pose, Vector};

use super::{Camera, Frame, Placed, Renderer, Scenery};
use crate::Step;
use raster::{Index, NOTHING, Target};
use shade::{SKY, SrgbTable, Surface, albedo, linear};
use shadow::ShadowMap;

/// Samples a pixel along each axis.
const SAMPLES: usize = 2;
/// How much the outline between two things darkens.
const OUTLINE: f32 = 0.45;
/// Two things are outlined where their depths differ by more than this part: not where they touch.
const OUTLINE_DEPTH_STEP: f32 = 0.02;

/// Renders on the calling thread. It keeps its buffers, and the shadows of the last state.
pub(super) struct CpuRenderer {
    scenery: Scenery,
    index: Index,
    /// Of each part.
    linear_rgb: Vec<Vector>,
    srgb: SrgbTable,
    /// What the shadows are of.
    placed: Placed,
    shadow: ShadowMap,
    target: Target,
    /// One sample a pixel, at its centre: what depth and ids are read from.
    centres: Target,
}

impl CpuRenderer {
    pub(super) fn new(scenery: Scenery) -> CpuRenderer {
        CpuRenderer {
            index: Index::new(&scenery),
            linear_rgb: scenery.parts.iter().map(|part| linear(part.rgb)).collect(),
            scenery,
            srgb: SrgbTable::default(),
            placed: Placed::default(),
            shadow: ShadowMap::default(),
            target: Target::default(),
            centres: Target::default(),
        }
    }
}

impl Renderer for CpuRenderer {
    fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        let placed = self.scenery.place(step);
        if self.placed != placed {
            self.shadow.draw(&self.scenery, &placed);
            self.placed = placed;
        }
        self.centres.draw(&self.scenery, &self.index, &self.placed, camera, 1);
        self.target.draw(&self.scenery, &self.index, &self.placed, camera, SAMPLES);
        let view = View::new(self, camera);
        let pixels = (camera.width * camera.height) as usize;
        let mut rgb = Vec::with_capacity(pixels * 3);
        for y in 0..camera.height as usize {
            for x in 0..camera.width as usize {
                rgb.extend(self.srgb.encode(view.pixel(x, y)));
            }
        }
        Frame {
            width: camera.width,
            height: camera.height,
            rgb,
            depth_m: self.centres.nearness.iter().map(|nearness| 1.0 / nearness).collect(),
            ids: self.centres.triangle.iter().map(|triangle| view.id(*triangle)).collect(),
        }
    }
}

/// A filled target, ready to be shaded.
struct View<'a> {
    scenery: &'a Scenery,
    index: &'a Index,
    linear_rgb: &'a [Vector],
    target: &'a Target,
    shadow: &'a ShadowMap,
    /// World from mesh and back, of each part.
    poses: Vec<(Pose, Pose)>,
    eye_m: Vector,
    /// Ray through the target's top left corner, and from one sample to the next, at a depth of 1 m in the world.
    corner_ray: Vector,
    ray_right: Vector,
    ray_down: Vector,
}

impl<'a> View<'a> {
    fn new(renderer: &'a CpuRenderer, camera: &Camera) -> View<'a> {
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        View {
            scenery: &renderer.scenery,
            index: &renderer.index,
            linear_rgb: &renderer.linear_rgb,
            target: &renderer.target,
            shadow: &renderer.shadow,
            poses: renderer.placed.world_from_mesh.iter().map(|pose| (*pose, pose.inverse())).collect(),
            eye_m: camera.world_from_camera.translation,
            corner_ray: rotation * camera.unproject([0.0, 0.0], 1.0),
            ray_right: rotation * Vector::X * sample,
            ray_down: rotation * Vector::NEG_Y * sample,
        }
    }

    fn id(&self, triangle: u32) -> u32 {
        match triangle {
            NOTHING => 0,
            _ => self.scenery.parts[self.index.owner[triangle as usize] as usize].id,
        }
    }

    /// Mean linear colour of a pixel's samples; a triangle that covers several is shaded once.
    fn pixel(&self, x: usize, y: usize) -> Vector {
        let mut shaded: [(u32, Vector); SAMPLES * SAMPLES] = [(0, Vector::ZERO); SAMPLES * SAMPLES];
        let mut count = 0;
        let mut sum = Vector::ZERO;
        let mut edges = 0;
        for i in 0..SAMPLES * SAMPLES {
            let (sx, sy) = (x * SAMPLES + i % SAMPLES, y * SAMPLES + i / SAMPLES);
            let triangle = self.target.triangle[sy * self.target.width + sx];
            edges += self.outlines(sx, sy);
            sum += match shaded[..count].iter().find(|(known, _)| *known == triangle) {
                Some((_, colour)) => *colour,
                None => {
                    let colour = if triangle == NOTHING { SKY } else { self.surface(sx, sy, triangle) };
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

    /// Colour of a triangle where a sample sees it.
    fn surface(&self, sx: usize, sy: usize, triangle: u32) -> Vector {
        let owner = self.index.owner[triangle as usize] as usize;
        let part = &self.scenery.parts[owner];
        let (world_from_mesh, mesh_from_world) = self.poses[owner];
        let depth_m = 1.0 / self.target.nearness[sy * self.target.width + sx];
        let ray = self.corner_ray + self.ray_right * (sx as f32 + 0.5) + self.ray_down * (sy as f32 + 0.5);
        let point_m = self.eye_m + ray * depth_m;
        let corners = part.mesh.triangles[(triangle - self.index.first[owner]) as usize];
        let [a, b, c] = corners.map(|corner| part.mesh.vertices[corner as usize]);
        let in_mesh_m = mesh_from_world * point_m;
        let (ab, ac, ap) =
            (b.position_m - a.position_m, c.position_m - a.position_m, in_mesh_m - a.position_m);
        let face = ab.cross(ac);
        let scale = 1.0 / face.length_squared();
        let weight_b = ap.cross(ac).dot(face) * scale;
        let weight_c = ab.cross(ap).dot(face) * scale;
        let normal = a.normal * (1.0 - weight_b - weight_c) + b.normal * weight_b + c.normal * weight_c;
        Surface {
            point_m,
            normal: (world_from_mesh.rotation * normal).normalize(),
            to_eye: -ray.normalize(),
            albedo: albedo(part.pattern, self.linear_rgb[owner], point_m),
        }
        .shade(self.shadow)
    }
}
