//! From samples to pixels: colour where a camera's rays meet triangles, and outlines between things.

use rapier3d::math::{Matrix, Vector};

use super::prepared::Prepared;
use super::raster::{NOTHING, SAMPLES, Target};
use super::shade::{SKY, Surface, albedo};
use super::shadow::ShadowMap;
use crate::render::{Camera, Placed};

/// How much the outline between two things darkens.
const OUTLINE: f32 = 0.45;
/// Two things are outlined where their depths differ by more than this part: not where they touch.
const OUTLINE_DEPTH_STEP: f32 = 0.02;

/// A filled target, ready to be shaded.
pub(super) struct View<'a> {
    prepared: &'a Prepared,
    target: &'a Target,
    shadow: &'a ShadowMap,
    /// Rotation and translation from each part's mesh to the world. Matrices, for they turn a vector fastest.
    world_from_mesh: Vec<(Matrix, Vector)>,
    eye_m: Vector,
    /// Ray through the target's top left corner, and from one sample to the next, at a depth of 1 m in the world.
    corner_ray: Vector,
    right_ray: Vector,
    down_ray: Vector,
}

impl<'a> View<'a> {
    pub(super) fn new(
        prepared: &'a Prepared,
        placed: &Placed,
        target: &'a Target,
        shadow: &'a ShadowMap,
        camera: &Camera,
    ) -> View<'a> {
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        let poses = placed.world_from_mesh.iter();
        View {
            prepared,
            target,
            shadow,
            world_from_mesh: poses.map(|pose| (Matrix::from_quat(pose.rotation), pose.translation)).collect(),
            eye_m: camera.world_from_camera.translation,
            corner_ray: rotation * camera.unproject([0.0, 0.0], 1.0),
            right_ray: rotation * Vector::X * sample,
            down_ray: rotation * Vector::NEG_Y * sample,
        }
    }

    /// Of the thing that a triangle belongs to.
    pub(super) fn id(&self, triangle: u32) -> u32 {
        match triangle {
            NOTHING => 0,
            _ => self.prepared.ids[triangle as usize],
        }
    }

    /// Mean linear colour of a pixel's samples; a triangle that covers several is shaded once.
    pub(super) fn pixel(&self, x: usize, y: usize) -> Vector {
        if self.is_plain(x * SAMPLES, y * SAMPLES) {
            return self.colour(x * SAMPLES, y * SAMPLES);
        }
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
                    let colour = self.colour(sx, sy);
                    shaded[count] = (triangle, colour);
                    count += 1;
                    colour
                }
            };
        }
        let outline = (edges as f32 / (2 * SAMPLES) as f32).min(1.0);
        sum * ((1.0 - OUTLINE * outline) / (SAMPLES * SAMPLES) as f32)
    }

    /// Whether one triangle covers all samples of a pixel and all of their neighbours to the right and below, so that
    /// there is no outline either.
    fn is_plain(&self, sx: usize, sy: usize) -> bool {
        let Target { width, height, ref triangle, .. } = *self.target;
        if sx + SAMPLES >= width || sy + SAMPLES >= height {
            return false;
        }
        let first = triangle[sy * width + sx];
        (sy..=sy + SAMPLES).all(|row| {
            let start = row * width + sx;
            triangle[start..=start + SAMPLES].iter().all(|other| *other == first)
        })
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
            let (near_a, near_b) = (self.target.nearness_1_m[here], self.target.nearness_1_m[there]);
            (near_a - near_b).abs() > OUTLINE_DEPTH_STEP * near_a.max(near_b)
        };
        u32::from(differs(here + 1)) + u32::from(differs(here + self.target.width))
    }

    /// Colour that a sample sees.
    fn colour(&self, sx: usize, sy: usize) -> Vector {
        let sample = sy * self.target.width + sx;
        let triangle = self.target.triangle[sample];
        if triangle == NOTHING {
            return SKY;
        }
        let face = &self.prepared.faces[triangle as usize];
        let owner = face.part as usize;
        let (rotation, translation_m) = self.world_from_mesh[owner];
        let depth_m = 1.0 / self.target.nearness_1_m[sample];
        let ray = self.corner_ray + self.right_ray * (sx as f32 + 0.5) + self.down_ray * (sy as f32 + 0.5);
        let point_m = self.eye_m + ray * depth_m;
        let normal = match face.bend_1_m {
            None => rotation * face.normal,
            Some(bend_1_m) => {
                let in_mesh_m = rotation.transpose() * (point_m - translation_m);
                (rotation * (face.normal + bend_1_m * (in_mesh_m - face.corner_m))).normalize()
            }
        };
        let pattern = self.prepared.scenery.parts[owner].pattern;
        Surface {
            point_m,
            normal,
            eye_direction: -ray.normalize(),
            albedo: albedo(pattern, self.prepared.linear_rgb[owner], point_m),
        }
        .shade(self.shadow)
    }
}
