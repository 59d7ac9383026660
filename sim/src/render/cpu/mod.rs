//! The embedded renderer: a visibility buffer of triangle numbers that is shaded afterwards, with four
//! samples per pixel.

mod baked;
mod blend;
pub mod contact;
mod images;
mod lamps;
mod raster;
mod shade;
mod shadow;
mod target;
mod veil;
mod view;
mod workspace;

use std::panic::resume_unwind;
use std::slice;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread;

use pulp::{Arch, Simd, WithSimd};

use crate::Step;
use crate::render::baked::lit;
use crate::render::blur::blurred;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::baked::LightCube;
use crate::render::shading::srgb::SrgbTable;
use crate::render::{Camera, Frame, Part, PlacedScenery, Renderer, Scenery, Wanted};
use baked::place_cubes;
use contact::ContactMap;
use lamps::LitLamps;
use raster::Rays;
use shade::Facet;
use shadow::ShadowMap;
use target::RenderTarget;
use veil::Veils;
use view::{Row, View};
use workspace::Workspace;

/// Renderer on the CPU. It draws on the calling thread, and several images of a state in parallel. It holds
/// its buffers only while it draws. The shadows of its last state are reused the next time, unless too many
/// other renderers have drawn in between.
pub(super) struct CpuRenderer {
    prepared: Arc<Prepared>,
    srgb: SrgbTable,
    /// Number of this renderer, unique in the process.
    number: u64,
}

/// A state of the scenery with its light, shared by the images of all cameras.
#[derive(Default)]
struct LitState {
    /// State for which shadow, contacts and facets were computed.
    placed: PlacedScenery,
    shadow: ShadowMap,
    lamps: LitLamps,
    contact: ContactMap,
    facets: Vec<Facet>,
    /// Ambient cube of each moving part, by part index.
    cubes: Vec<LightCube>,
}

impl LitState {
    /// Clears the state for any renderer: no cached light is reused for the next drawing.
    fn forget(&mut self) {
        self.placed = PlacedScenery::default();
        self.shadow.forget();
        self.lamps.forget();
        self.contact.forget();
    }
}

/// The buffers of one image.
#[derive(Default)]
struct Canvas {
    row: Row,
    samples: RenderTarget,
    /// One sample per pixel, at its centre, from which depth and ids are read.
    centres: RenderTarget,
    /// Blended surfaces at the samples, and at the centres.
    veils: Veils,
    veils_at_centres: Veils,
}

impl CpuRenderer {
    pub(super) fn new(scenery: Scenery) -> CpuRenderer {
        static RENDERERS: AtomicU64 = AtomicU64::new(0);
        CpuRenderer {
            prepared: lit(scenery),
            srgb: SrgbTable::default(),
            number: RENDERERS.fetch_add(1, Ordering::Relaxed),
        }
    }

    /// Renders the image of each camera, the first on this thread and the others in parallel. An image
    /// is the same bit for bit, regardless of the others.
    pub(super) fn draw_placed(&mut self, placed: PlacedScenery, cameras: &[Camera]) -> Vec<Frame> {
        self.draw(placed, cameras, Wanted::All)
    }

    fn draw(&mut self, placed: PlacedScenery, cameras: &[Camera], wanted: Wanted) -> Vec<Frame> {
        let CpuRenderer { prepared, srgb, number } = self;
        let arch = Arch::new();
        let mut workspace = Workspace::take(*number, cameras.len());
        let Workspace { state, canvases, .. } = &mut workspace;
        if state.placed != placed {
            arch.dispatch(StateDrawing { state, prepared, placed });
        }
        let (prepared, srgb, state) = (&*prepared, &*srgb, &*state);
        let draw = |(canvas, camera)| {
            arch.dispatch(PictureDrawing { state, prepared, srgb, canvas, camera, wanted })
        };
        let mut pictures = canvases.iter_mut().zip(cameras);
        let first = pictures.next();
        thread::scope(|scope| {
            let others: Vec<_> = pictures.map(|picture| scope.spawn(move || draw(picture))).collect();
            let others =
                others.into_iter().map(|other| other.join().unwrap_or_else(|panic| resume_unwind(panic)));
            first.map(draw).into_iter().chain(others).collect()
        })
    }
}

impl Drop for CpuRenderer {
    fn drop(&mut self) {
        Workspace::forget(self.number);
    }
}

impl Renderer for CpuRenderer {
    fn name(&self) -> &str {
        "cpu"
    }

    fn render_all(&mut self, step: &Step, cameras: &[Camera]) -> Vec<Frame> {
        let placed = self.prepared.scenery.place(step);
        self.draw_placed(placed, cameras)
    }

    fn render_colours(&mut self, step: &Step, camera: &Camera) -> Vec<u8> {
        let placed = self.prepared.scenery.place(step);
        self.draw(placed, slice::from_ref(camera), Wanted::Colours).swap_remove(0).rgb
    }
}

/// Drawing of a state's light. This and [`PictureDrawing`] are compiled once more for processors with wide
/// registers, including everything that is inlined into them. The results are bit-identical.
struct StateDrawing<'a> {
    state: &'a mut LitState,
    prepared: &'a Prepared,
    placed: PlacedScenery,
}

impl WithSimd for StateDrawing<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let StateDrawing { state, prepared, placed } = self;
        let Scenery { light, lamps, .. } = &prepared.scenery;
        match lamps {
            None => state.shadow.draw(simd, prepared, &placed, light.sun_direction),
            Some(lamps) => state.lamps.draw(simd, lamps, prepared, &placed),
        }
        state.contact.draw(prepared, &placed);
        shade::place(&mut state.facets, prepared, &placed, &state.placed);
        place_cubes(&mut state.cubes, prepared, &placed, &state.placed);
        state.placed = placed;
    }
}

/// Drawing of an image.
struct PictureDrawing<'a> {
    state: &'a LitState,
    prepared: &'a Prepared,
    srgb: &'a SrgbTable,
    canvas: &'a mut Canvas,
    camera: &'a Camera,
    wanted: Wanted,
}

impl WithSimd for PictureDrawing<'_> {
    type Output = Frame;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Frame {
        let PictureDrawing { state, prepared, srgb, canvas, camera, wanted } = self;
        let Canvas { row, samples, centres, veils, veils_at_centres } = canvas;
        let measured = (wanted == Wanted::All).then_some(&mut *centres);
        target::draw(simd, samples, measured, prepared, &state.placed, camera);
        veils.draw(simd, samples, prepared, &state.placed, camera);
        let mut view = View {
            prepared,
            facets: &state.facets,
            cubes: &state.cubes,
            target: samples,
            veils,
            shadow: &state.shadow,
            lamps: prepared.scenery.lamps.is_some().then_some(&state.lamps),
            contact: &state.contact,
            rays: Rays::new(camera),
        };
        let mut frame = Frame {
            width: camera.width,
            height: camera.height,
            rgb: blurred(view.rgb(row, srgb), camera),
            depth_m: Vec::new(),
            ids: Vec::new(),
        };
        if wanted == Wanted::Colours {
            return frame;
        }
        frame.depth_m.reserve_exact((camera.width * camera.height) as usize);
        frame.ids.reserve_exact((camera.width * camera.height) as usize);
        for row in 0..camera.height as usize {
            centres.finish_row(row);
            frame.depth_m.extend(centres.nearness_1_m(row).iter().map(|nearness| 1.0 / nearness));
            frame.ids.extend(centres.patches(row).iter().map(|patch| prepared.id(*patch)));
        }
        if prepared.scenery.parts.iter().any(Part::is_cut_out) {
            veils_at_centres.draw(simd, centres, prepared, &state.placed, camera);
            veils_at_centres.measure(prepared, &state.facets, &Rays::new(camera), &mut frame);
        }
        frame
    }
}
