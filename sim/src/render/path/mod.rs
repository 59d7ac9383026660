//! Path tracing on the processor: light that bounces, soft shadows, and reflections in a clear coat.
//!
//! [`Space`] answers where rays meet the scenery, [`Scene`] how much light comes along them, [`PathView`]
//! looks and lights pixel by pixel, [`filtered`] removes the noise of few paths, and [`Negative`] turns
//! light to colours. An image is the same bit for bit on any number of threads.

mod develop;
mod directions;
mod exposure;
mod filter;
mod lights;
mod rows;
mod scene;
mod sequence;
mod space;
#[cfg(test)]
mod tests;
mod view;

use std::thread;

use rapier3d::math::{Pose, Vector};

use crate::Step;
use crate::render::blur::blurred;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::srgb::SrgbTable;
use crate::render::{Camera, Carrier, Frame, PlacedScenery, Renderer, Scenery};
use develop::Negative;
use exposure::exposure_factor;
use filter::filtered;
use lights::Lights;
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
    prepared: Prepared,
    room: Body,
    movers: Vec<Mover>,
    lights: Lights,
    paths: SampleCount,
    srgb: SrgbTable,
}

/// Parts that move together.
struct Mover {
    body: Body,
    /// The first of its parts, from whose pose that of the body follows.
    first_part: usize,
    mesh_from_carrier: Pose,
}

impl PathRenderer {
    pub(super) fn new(scenery: Scenery) -> PathRenderer {
        let prepared = Prepared::new(scenery);
        let scenery = &prepared.scenery;
        let of_room = |number: &usize| scenery.parts[*number].carrier == Carrier::Room;
        let room = Body::of(scenery, (0..scenery.parts.len()).filter(of_room));
        let lights = Lights::of(scenery, &room);
        let (movers, srgb) = (movers(scenery), SrgbTable::default());
        PathRenderer { room, movers, lights, paths: PATHS, srgb, prepared }
    }

    /// Returns the scenery at its poses.
    fn scene(&self, placed: &PlacedScenery) -> Scene<'_> {
        let poses = self
            .movers
            .iter()
            .map(|mover| (&mover.body, placed.world_from_mesh[mover.first_part] * mover.mesh_from_carrier));
        Scene {
            space: Space::new(&self.room, poses),
            prepared: &self.prepared,
            lights: &self.lights,
            patterns: patterns(&self.prepared, placed),
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
        let light = &self.prepared.scenery.light;
        let exposure_factor = exposure_factor(light, view.eye_m(), &guides, &light_rgb);
        let depth_m = pixels.iter().map(|pixel| pixel.depth_m).collect();
        Negative { view, depth_m, guides, light_rgb, width, exposure_factor }
    }
}

/// Returns the bodies of everything but the room.
fn movers(scenery: &Scenery) -> Vec<Mover> {
    let mut carriers: Vec<(Carrier, usize)> = Vec::new();
    for (number, part) in scenery.parts.iter().enumerate() {
        let is_known = || carriers.iter().any(|(carrier, _)| *carrier == part.carrier);
        if part.carrier != Carrier::Room && !is_known() {
            carriers.push((part.carrier, number));
        }
    }
    let mover = |(carrier, first_part): (Carrier, usize)| {
        let own = (0..scenery.parts.len()).filter(|number| scenery.parts[*number].carrier == carrier);
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
