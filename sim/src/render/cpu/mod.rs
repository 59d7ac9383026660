//! The embedded renderer: a visibility buffer of triangle numbers, shaded afterwards, four samples a pixel.

mod prepared;
mod raster;
mod shade;
mod shadow;
mod srgb;
mod view;

use super::{Camera, Frame, Placed, Renderer, Scenery};
use crate::Step;
use prepared::Prepared;
use raster::Target;
use shadow::ShadowMap;
use srgb::SrgbTable;
use view::View;

/// Renders on the calling thread. It keeps its buffers, and the shadows of the last state.
pub(super) struct CpuRenderer {
    prepared: Prepared,
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
            prepared: Prepared::new(scenery),
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
        let placed = self.prepared.scenery.place(step);
        if self.placed != placed {
            self.shadow.draw(&self.prepared.scenery, &placed);
            self.placed = placed;
        }
        self.target.draw(&mut self.centres, &self.prepared, &self.placed, camera);
        let view = View::new(&self.prepared, &self.placed, &self.target, &self.shadow, camera);
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
            depth_m: self.centres.nearness_1_m.iter().map(|nearness| 1.0 / nearness).collect(),
            ids: self.centres.triangle.iter().map(|triangle| view.id(*triangle)).collect(),
        }
    }
}
