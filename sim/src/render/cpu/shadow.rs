//! Shadow of the sun around the focus.

use rapier3d::math::{Matrix, Pose, Rotation, Vector};

use super::raster::for_spans;
use crate::render::{Placed, Scenery};

/// Direction to the sun; high, so that hands over a counter cast their shadow on it.
pub(super) const TO_SUN: Vector = Vector::new(-0.306_186_2, 0.353_553_4, 0.883_883_5);
/// Texels along each side: 2.4 mm at a focus of 1.25 m, so that fingers cast shadows.
const TEXELS: usize = 1024;
/// The sun's camera stands this far from the focus.
const DISTANCE_M: f32 = 8.0;
/// A surface does not shade itself: it is looked up this far along its normal, and this much nearer to the sun.
const NORMAL_OFFSET_M: f32 = 0.006;
const BIAS_M: f32 = 0.004;

#[derive(Default)]
pub(super) struct ShadowMap {
    /// "Nearness" here is [`DISTANCE_M`] minus the distance from the sun's plane, and grows towards the sun.
    nearness_m: Vec<f32>,
    sun_from_world: Pose,
    texels_per_m: f32,
}

impl ShadowMap {
    /// Draws the shadows of everything that casts one.
    pub(super) fn draw(&mut self, scenery: &Scenery, placed: &Placed) {
        let x = Vector::Z.cross(TO_SUN).normalize();
        let rotation = Rotation::from_mat3(&Matrix::from_cols(x, TO_SUN.cross(x), TO_SUN));
        self.sun_from_world = Pose::from_parts(placed.focus_m, rotation).inverse();
        self.texels_per_m = TEXELS as f32 / (2.0 * scenery.focus_radius_m);
        self.nearness_m.clear();
        self.nearness_m.resize(TEXELS * TEXELS, 0.0);
        let mut corners = Vec::new();
        let parts = scenery.parts.iter().zip(&placed.world_from_mesh);
        for (part, world_from_mesh) in parts.filter(|(part, _)| part.casts_shadow) {
            let sun_from_mesh = self.sun_from_world * *world_from_mesh;
            let vertices = part.mesh.vertices.iter();
            corners.clear();
            corners.extend(vertices.map(|vertex| self.texel(sun_from_mesh * vertex.position_m)));
            for triangle in &part.mesh.triangles {
                let corners = triangle.map(|corner| corners[corner as usize]);
                for_spans(corners, TEXELS, TEXELS, |span, start, step| {
                    for (i, nearest) in self.nearness_m[span].iter_mut().enumerate() {
                        *nearest = nearest.max(start + step * i as i32 as f32);
                    }
                });
            }
        }
    }

    /// Map coordinates and nearness of a point in the sun's frame.
    fn texel(&self, point_m: Vector) -> [f32; 3] {
        let half = 0.5 * TEXELS as f32;
        [half + point_m.x * self.texels_per_m, half - point_m.y * self.texels_per_m, point_m.z + DISTANCE_M]
    }

    /// 1 in the sun, 0 in the shadow, smooth over three texels; points outside the map are in the sun.
    pub(super) fn sunlit(&self, point_m: Vector, normal: Vector) -> f32 {
        let [u, v, nearness] = self.texel(self.sun_from_world * (point_m + normal * NORMAL_OFFSET_M));
        let (u, v) = (u - 0.5, v - 0.5);
        let inside = |i: f32| i >= 1.0 && i < (TEXELS - 3) as f32;
        if !inside(u) || !inside(v) {
            return 1.0;
        }
        let (column, row) = (usize::from(u as u16), usize::from(v as u16));
        // Four taps with a tent's weights are a bilinear filter three texels wide.
        let weights = |part: f32| [1.0 - part, 1.0, 1.0, part];
        let (across, down) = (weights(u - column as f32), weights(v - row as f32));
        let mut columns = [0.0; 4];
        for (j, weight) in down.into_iter().enumerate() {
            let start = (row - 1 + j) * TEXELS + column - 1;
            for (sum, occluder) in columns.iter_mut().zip(&self.nearness_m[start..start + 4]) {
                *sum += if nearness + BIAS_M >= *occluder { weight } else { 0.0 };
            }
        }
        let sum: f32 = columns.into_iter().zip(across).map(|(sum, weight)| sum * weight).sum();
        sum / 9.0
    }
}
