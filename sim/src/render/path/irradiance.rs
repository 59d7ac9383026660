//! Incoming light at points of an empty room, in which nothing moves.

use std::thread;

use rapier3d::math::Vector;

use super::PathRenderer;
use super::directions::cosine_about;
use super::rows::for_each_row;
use super::scene::Scene;
use super::sequence::{PixelSeed, SampleCount};
use super::space::body::MetSides;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::SurfacePoint;
use crate::render::{PlacedScenery, Scenery};

/// Number of paths per point, and number of sampled points on lamps.
const PATHS: SampleCount = SampleCount(64);
const LAMP_POINTS: SampleCount = SampleCount(32);
/// Number of rays that decide if a point is inside an object. For a point outside, at most this share of them
/// may hit a back face first.
const INSIDE_RAYS: SampleCount = SampleCount(16);
const MAX_INSIDE_SHARE: f32 = 0.3;
/// Distance from a surface at which rays that leave it start.
const OFF_M: f32 = 1e-3;
/// Number of points that a thread processes as one batch.
const ROW: usize = 64;
/// Purposes of a point's random numbers.
const FOR_INSIDE: u32 = 0;
const FOR_LAMPS: u32 = 1;
const FOR_LIGHT: u32 = 2;

/// Irradiance at a point, divided by pi.
#[derive(Clone, Copy, Default)]
pub struct Irradiance {
    pub of_lamps_rgb: Vector,
    pub reflected_rgb: Vector,
    /// True if the point is inside an object, where light does not count.
    pub is_inside: bool,
}

/// Returns the light at points of a room. It is the same bit for bit on any number of threads.
pub fn irradiance(room: Scenery, points: &[SurfacePoint]) -> Vec<Irradiance> {
    let placed = PlacedScenery {
        world_from_mesh: room.parts.iter().map(|part| part.carrier_from_mesh).collect(),
        ..PlacedScenery::default()
    };
    let renderer = PathRenderer::new(Prepared::new(room));
    let scene = renderer.scene(&placed);
    let mut found = vec![Irradiance::default(); points.len()];
    let threads = thread::available_parallelism().map_or(1, usize::from);
    for_each_row(&mut found, ROW, threads, |row, found| {
        for (irradiance, point) in found.iter_mut().zip(&points[row * ROW..]) {
            *irradiance = at_point(&scene, point);
        }
    });
    found
}

fn at_point(scene: &Scene, SurfacePoint { point_m, normal, seed }: &SurfacePoint) -> Irradiance {
    let (start_m, seed) = (*point_m + *normal * OFF_M, PixelSeed::of(*seed));
    if is_inside(scene, start_m, *normal, seed) {
        return Irradiance { is_inside: true, ..Irradiance::default() };
    }
    let lit = |sample: u32| {
        let beam = scene.lights.beam(start_m, seed.spread(FOR_LAMPS, sample, LAMP_POINTS));
        scene.lit_rgb(start_m, *normal, &beam)
    };
    let arriving = |sample: u32| {
        let direction = cosine_about(*normal, seed.spread(FOR_LIGHT, sample, PATHS));
        scene.arriving_rgb(start_m, direction, &mut seed.independent(FOR_LIGHT, sample))
    };
    Irradiance {
        of_lamps_rgb: (0..LAMP_POINTS.0).map(lit).sum::<Vector>() / LAMP_POINTS.0 as f32,
        reflected_rgb: (0..PATHS.0).map(arriving).sum::<Vector>() / PATHS.0 as f32,
        is_inside: false,
    }
}

/// Returns true if too many of the surfaces around a point face away from it.
fn is_inside(scene: &Scene, start_m: Vector, normal: Vector, seed: PixelSeed) -> bool {
    let meets_back = |sample: &u32| {
        let direction = cosine_about(normal, seed.spread(FOR_INSIDE, *sample, INSIDE_RAYS));
        let reach_m = |sides| scene.space.nearest(start_m, direction, 0.0, sides).map(|(reach_m, _)| reach_m);
        let front_m = reach_m(MetSides::Front).unwrap_or(f32::INFINITY);
        reach_m(MetSides::Both).is_some_and(|nearest_m| nearest_m < front_m)
    };
    let count = (0..INSIDE_RAYS.0).filter(meets_back).count();
    count as f32 > MAX_INSIDE_SHARE * INSIDE_RAYS.0 as f32
}
