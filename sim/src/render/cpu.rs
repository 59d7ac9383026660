//! The embedded renderer: a visibility buffer of triangle numbers, shaded afterwards, four samples a pixel.

use rapier3d::math::Vector;

use super::raster::{NOTHING, Numbering, Target};
use super::shade::{SKY, SrgbTable, Surface, albedo, linear};
use super::shadow::ShadowMap;
use super::{Camera, Frame, RenderScene};

/// Samples a pixel along each axis.
const SAMPLES: usize = 2;
/// How much the outline between two things darkens.
const OUTLINE: f32 = 0.45;
/// Two things are outlined where their depths differ by more than this part: not where they touch.
const OUTLINE_DEPTH_STEP: f32 = 0.02;

/// Renders on the calling thread. It keeps its buffers, and the shadows of the last scene.
#[derive(Default)]
pub struct CpuRenderer {
    target: Target,
    /// One sample a pixel, at its centre: what depth and ids are read from.
    centres: Target,
    shadow: ShadowMap,
    srgb: SrgbTable,
}

impl CpuRenderer {
    /// Draws `scene` as `camera` sees it.
    pub fn render(&mut self, scene: &RenderScene, camera: &Camera) -> Frame {
        let numbering = Numbering::new(scene);
        self.shadow.update(scene);
        self.centres.draw(scene, &numbering, camera, 1);
        self.target.draw(scene, &numbering, camera, SAMPLES);
        let view = View::new(scene, &numbering, camera, &self.target, &self.shadow);
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
    scene: &'a RenderScene,
    numbering: &'a Numbering,
    camera: &'a Camera,
    target: &'a Target,
    shadow: &'a ShadowMap,
    /// Of each instance.
    linear_rgb: Vec<Vector>,
    /// Ray through the target's top left corner, and from one sample to the next, at a depth of 1 m in the world.
    corner_ray: Vector,
    ray_right: Vector,
    ray_down: Vector,
}

impl<'a> View<'a> {
    fn new(
        scene: &'a RenderScene,
        numbering: &'a Numbering,
        camera: &'a Camera,
        target: &'a Target,
        shadow: &'a ShadowMap,
    ) -> View<'a> {
        let linear_rgb = scene.instances.iter().map(|instance| linear(instance.rgb)).collect();
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        let corner_ray = rotation * camera.unproject([0.0, 0.0], 1.0);
        let (ray_right, ray_down) = (rotation * Vector::X * sample, rotation * Vector::NEG_Y * sample);
        View { scene, numbering, camera, target, shadow, linear_rgb, corner_ray, ray_right, ray_down }
    }

    fn id(&self, triangle: u32) -> u32 {
        match triangle {
            NOTHING => 0,
            _ => self.scene.instances[self.numbering.owner[triangle as usize] as usize].id,
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
        let owner = self.numbering.owner[triangle as usize] as usize;
        let instance = &self.scene.instances[owner];
        let depth_m = 1.0 / self.target.nearness[sy * self.target.width + sx];
        let ray = self.corner_ray + self.ray_right * (sx as f32 + 0.5) + self.ray_down * (sy as f32 + 0.5);
        let eye_m = self.camera.world_from_camera.translation;
        let point_m = eye_m + ray * depth_m;
        let mesh = &self.scene.meshes[instance.mesh];
        let corners = mesh.triangles[(triangle - self.numbering.first[owner]) as usize];
        let [a, b, c] = corners.map(|corner| mesh.vertices[corner as usize]);
        let in_mesh_m = instance.world_from_mesh.inverse() * point_m;
        let (ab, ac, ap) =
            (b.position_m - a.position_m, c.position_m - a.position_m, in_mesh_m - a.position_m);
        let face = ab.cross(ac);
        let scale = 1.0 / face.length_squared();
        let weight_b = ap.cross(ac).dot(face) * scale;
        let weight_c = ab.cross(ap).dot(face) * scale;
        let normal = a.normal * (1.0 - weight_b - weight_c) + b.normal * weight_b + c.normal * weight_c;
        Surface {
            point_m,
            normal: (instance.world_from_mesh.rotation * normal).normalize(),
            to_eye: -ray.normalize(),
            albedo: albedo(instance, self.linear_rgb[owner], point_m),
        }
        .shade(self.shadow)
    }
}
