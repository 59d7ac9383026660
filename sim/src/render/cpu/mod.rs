//! The embedded renderer: a visibility buffer of triangle numbers, shaded afterwards, four samples a pixel.

pub mod contact;
mod raster;
mod shade;
mod shadow;
mod target;
mod view;

use pulp::{Arch, Simd, WithSimd};

use crate::Step;
use crate::render::scene::prepared::Prepared;
use crate::render::{Camera, Frame, PlacedScenery, Renderer, Scenery};
use contact::ContactMap;
use shade::{Facet, Rays};
use shadow::ShadowMap;
use target::RenderTarget;
use view::{Row, SrgbTable, View};

/// Renders on the calling thread. It keeps its buffers, and the shadows of the last state.
pub(super) struct CpuRenderer {
    prepared: Prepared,
    srgb: SrgbTable,
    /// What shadow, contacts and facets are of.
    placed: PlacedScenery,
    shadow: ShadowMap,
    contact: ContactMap,
    row: Row,
    facets: Vec<Facet>,
    samples: RenderTarget,
    /// One sample a pixel, at its centre: what depth and ids are read from.
    centres: RenderTarget,
}

impl CpuRenderer {
    pub(super) fn new(scenery: Scenery) -> CpuRenderer {
        CpuRenderer {
            prepared: Prepared::new(scenery),
            srgb: SrgbTable::default(),
            placed: PlacedScenery::default(),
            shadow: ShadowMap::default(),
            contact: ContactMap::default(),
            row: Row::default(),
            facets: Vec::new(),
            samples: RenderTarget::default(),
            centres: RenderTarget::default(),
        }
    }
}

impl Renderer for CpuRenderer {
    fn name(&self) -> &str {
        "cpu"
    }

    fn render(&mut self, step: &Step, camera: &Camera) -> Frame {
        let placed = self.prepared.scenery.place(step);
        self.draw_placed(placed, camera)
    }
}

/// A picture to draw. It is compiled once more for processors with wide registers, with everything that is inlined into it;
/// its bits are the same.
struct PictureDrawing<'a> {
    renderer: &'a mut CpuRenderer,
    placed: PlacedScenery,
    camera: &'a Camera,
}

impl WithSimd for PictureDrawing<'_> {
    type Output = Frame;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Frame {
        self.renderer.draw(simd, self.placed, self.camera)
    }
}

impl CpuRenderer {
    pub(super) fn draw_placed(&mut self, placed: PlacedScenery, camera: &Camera) -> Frame {
        Arch::new().dispatch(PictureDrawing { renderer: self, placed, camera })
    }

    #[inline(always)]
    fn draw<S: Simd>(&mut self, simd: S, placed: PlacedScenery, camera: &Camera) -> Frame {
        if self.placed != placed {
            self.shadow.draw(simd, &self.prepared, &placed);
            self.contact.draw(&self.prepared, &placed);
            shade::place(&mut self.facets, &self.prepared, &placed);
            self.placed = placed;
        }
        target::draw(simd, &mut self.samples, &mut self.centres, &self.prepared, &self.placed, camera);
        let view = View {
            prepared: &self.prepared,
            facets: &self.facets,
            target: &self.samples,
            shadow: &self.shadow,
            contact: &self.contact,
            rays: Rays::new(camera),
        };
        let mut frame = Frame {
            width: camera.width,
            height: camera.height,
            rgb: view.rgb(&mut self.row, &self.srgb),
            depth_m: Vec::with_capacity((camera.width * camera.height) as usize),
            ids: Vec::with_capacity((camera.width * camera.height) as usize),
        };
        for row in 0..camera.height as usize {
            frame.depth_m.extend(self.centres.nearness_1_m(row).iter().map(|nearness| 1.0 / nearness));
            frame.ids.extend(self.centres.sheets(row).iter().map(|sheet| self.prepared.id(*sheet)));
        }
        frame
    }
}
