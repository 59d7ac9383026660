//! Path tracing on the processor: light that bounces, soft shadows, and reflections in a clear coat.
//!
//! [`Space`] finds where rays meet the scenery, and [`Scene`] computes the light along them. [`PathView`]
//! finds and lights the surface of each pixel, [`filtered`] removes the noise of few paths, and [`Negative`]
//! converts light to colours. An image is the same bit for bit on any number of threads.

mod develop;
mod directions;
mod exposure;
mod filter;
pub mod irradiance;
mod lights;
mod rows;
mod scene;
mod sequence;
mod space;
#[cfg(test)]
mod tests;
mod view;

use std::sync::Arc;
use std::thread;

use rapier3d::math::{Pose, Vector};

use crate::Step;
use crate::render::blur::blurred;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::srgb::SrgbTable;
use crate::render::{Camera, Carrier, Frame, PlacedScenery, Renderer, Scenery};
use develop::Negative;
pub(super) use develop::toned_rgb;
use exposure::exposure_factor;
use filter::filtered;
use lights::Lights;
pub(super) use lights::walls_m;
use rows::for_each_row;
use scene::{LAYERS, Scene, patterns};
use sequence::SampleCount;
use space::Space;
use space::body::Body;
use view::{PathView, Pixel, SeenSurface};

/// Number of paths at each pixel.
const PATHS: SampleCount = SampleCount(2);

/// Renderer by path tracing.
pub(super) struct PathRenderer {
    prepared: Arc<Prepared>,
    room: Body,
    movers: Vec<Mover>,
    /// Blended parts, by their carriers.
    veils: Vec<Mover>,
    no_room: Body,
    lights: Lights,
    paths: SampleCount,
    srgb: SrgbTable,
}

/// Parts that move together.
struct Mover {
    body: Body,
    /// The first of its parts. The pose of the body follows from this part's pose.
    first_part: usize,
    mesh_from_carrier: Pose,
}

impl PathRenderer {
    pub(super) fn new(prepared: impl Into<Arc<Prepared>>) -> PathRenderer {
        let prepared = prepared.into();
        let scenery = &prepared.scenery;
        let of_room =
            |number: &usize| scenery.parts[*number].carrier == Carrier::Room && !prepared.is_veil[*number];
        let room = Body::of(scenery, (0..scenery.parts.len()).filter(of_room));
        let lights = Lights::of(scenery, &room);
        let movers_of = |are_veils: bool| {
            let is_mover = |number: &usize| {
                let is_veil = prepared.is_veil[*number];
                is_veil == are_veils && (is_veil || scenery.parts[*number].carrier != Carrier::Room)
            };
            movers(scenery, (0..scenery.parts.len()).filter(is_mover).collect())
        };
        let (movers, veils) = (movers_of(false), movers_of(true));
        let (no_room, srgb) = (Body::of(scenery, std::iter::empty()), SrgbTable::default());
        PathRenderer { room, movers, veils, no_room, lights, paths: PATHS, srgb, prepared }
    }

    /// Returns the scenery at these poses.
    fn scene(&self, placed: &PlacedScenery) -> Scene<'_> {
        Scene {
            space: space(&self.room, &self.movers, placed),
            veils: (!self.veils.is_empty()).then(|| space(&self.no_room, &self.veils, placed)),
            prepared: &self.prepared,
            lights: self.lights.placed(self.prepared.scenery.lamps.as_ref(), placed),
            patterns: patterns(&self.prepared, placed),
            upward_direction: placed.world_from_mesh.iter().map(|pose| pose.rotation * Vector::Z).collect(),
        }
    }

    /// Returns the image of a camera, drawn on `threads` threads.
    fn draw(&self, scene: &Scene, camera: &Camera, threads: usize) -> Frame {
        let negative = self.negative(scene, camera, threads);
        let width = camera.width as usize;
        let mut rgb = vec![0; negative.guides.len() * 3];
        for_each_row(&mut rgb, width * 3, threads, |row, bytes| {
            let colours: Vec<Vector> = (0..width).map(|column| negative.linear_rgb(row, column)).collect();
            let planes = [0, 1, 2].map(|axis| colours.iter().map(|rgb| rgb[axis]).collect());
            self.srgb.encode(&planes, bytes);
        });
        Frame {
            width: camera.width,
            height: camera.height,
            rgb: blurred(rgb, camera),
            ids: negative.guides.iter().map(|seen| seen.id).collect(),
            depth_m: negative.depth_m,
        }
    }

    /// Returns the light that a camera sees.
    fn negative<'a>(&self, scene: &'a Scene<'a>, camera: &Camera, threads: usize) -> Negative<'a> {
        let width = camera.width as usize;
        let view = PathView::new(scene, camera, self.paths);
        let mut pixels = vec![Pixel::default(); width * camera.height as usize];
        for_each_row(&mut pixels, width, threads, |row, pixels| view.look(row, pixels));
        let mut light_rgb = vec![[Vector::ZERO; LAYERS]; pixels.len()];
        for_each_row(&mut light_rgb, width, threads, |row, light_rgb| {
            view.light(row, &pixels[row * width..(row + 1) * width], light_rgb);
        });
        let guides: Vec<SeenSurface> = pixels.iter().map(|pixel| pixel.seen).collect();
        let light_rgb = filtered(light_rgb, &guides, width, threads);
        let exposure_factor = exposure_factor(&view, &guides, &light_rgb);
        let depth_m = pixels.iter().map(|pixel| pixel.depth_m).collect();
        Negative { view, depth_m, guides, light_rgb, width, exposure_factor }
    }
}

/// Returns a room and other bodies at their poses.
fn space<'a>(room: &'a Body, movers: &'a [Mover], placed: &PlacedScenery) -> Space<'a> {
    let pose = |mover: &Mover| placed.world_from_mesh[mover.first_part] * mover.mesh_from_carrier;
    Space::new(room, movers.iter().map(|mover| (&mover.body, pose(mover))))
}

/// Returns the bodies of some parts, by their carriers.
fn movers(scenery: &Scenery, parts: Vec<usize>) -> Vec<Mover> {
    let carrier_of = |number: usize| scenery.parts[number].carrier;
    let mut carriers: Vec<(Carrier, usize)> = Vec::new();
    for number in &parts {
        if !carriers.iter().any(|(carrier, _)| *carrier == carrier_of(*number)) {
            carriers.push((carrier_of(*number), *number));
        }
    }
    let mover = |(carrier, first_part): (Carrier, usize)| {
        let own = parts.iter().copied().filter(|number| carrier_of(*number) == carrier);
        Mover {
            body: Body::of(scenery, own),
            first_part,
            mesh_from_carrier: scenery.parts[first_part].carrier_from_mesh.inverse(),
        }
    };
    carriers.into_iter().map(mover).collect()
}

impl Renderer for PathRenderer {
    fn name(&self) -> &str {
        "path"
    }

    fn render_all(&mut self, step: &Step, cameras: &[Camera]) -> Vec<Frame> {
        let scene = self.scene(&self.prepared.scenery.place(step));
        let threads = thread::available_parallelism().map_or(1, usize::from);
        cameras.iter().map(|camera| self.draw(&scene, camera, threads)).collect()
    }

    fn render_colours(&mut self, step: &Step, camera: &Camera) -> Vec<u8> {
        let scene = self.scene(&self.prepared.scenery.place(step));
        self.draw(&scene, camera, 1).rgb
    }
}
