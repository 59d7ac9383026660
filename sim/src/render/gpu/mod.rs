//! GPU renderer, based on wgpu. It draws the same images as the embedded renderer, in the same steps: the
//! triangle that each sample sees, then its colour. Tests compare the two.

mod baked;
mod device;
mod images;
mod passes;
mod proof;
mod scene;
mod shader;
mod targets;
#[cfg(test)]
mod tests;
mod together;

use std::slice;
use std::sync::{Arc, OnceLock};

use wgpu::{
    Buffer, Color, CommandEncoder, LoadOp, Operations, RenderPass, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, TextureView,
};

use crate::Step;
use crate::render::baked::lit;
use crate::render::cpu::contact::ContactMap;
use crate::render::scene::prepared::{NOTHING, Prepared};
use crate::render::{Camera, Frame, PlacedScenery, Renderer, Scenery, Wanted, cpu};
use device::{Gpu, GpuError};
use scene::SceneBuffers;
use targets::{Attachments, PictureBuffers, ShadowMaps, Targets, shadow_maps};
pub(super) use together::colours;
use together::{Asked, Region};

/// Returns the name of the device that draws.
pub(super) fn name() -> Result<String, GpuError> {
    Ok(open()?.name.clone())
}

pub(super) fn renderer(scenery: Scenery) -> Result<Box<dyn Renderer>, GpuError> {
    Ok(Box::new(GpuRenderer::new(open()?, scenery)))
}

/// Returns true if there is a hardware GPU, not only software in its place.
pub(super) fn is_real() -> bool {
    static REAL: OnceLock<bool> = OnceLock::new();
    *REAL.get_or_init(device::is_real)
}

/// Side in pixels of the squares that are resolved together.
const GROUP: u32 = 8;

/// Renderer on a GPU. After a failure the embedded renderer takes over.
pub struct GpuRenderer {
    gpu: Arc<Gpu>,
    prepared: Arc<Prepared>,
    scene: SceneBuffers,
    shadow: ShadowMaps,
    /// Poses of the parts in GPU memory, for which the shadow was also drawn.
    placed: Option<PlacedScenery>,
    contact: ContactMap,
    /// Targets of the last image's size.
    targets: Option<Targets>,
    /// Buffers from which images are read, if this renderer has drawn alone or as the first of several.
    pictures: Option<PictureBuffers>,
    embedded: Option<Box<dyn Renderer>>,
}

/// Opens the best device and checks it with a test image. A process does so once, since it takes longer than
/// many images.
fn open() -> Result<Arc<Gpu>, GpuError> {
    static OPENED: OnceLock<Result<Arc<Gpu>, GpuError>> = OnceLock::new();
    let opened = OPENED.get_or_init(|| {
        let gpu = Arc::new(Gpu::open()?);
        let mut renderer = GpuRenderer::new(gpu.clone(), proof::scenery());
        let cameras = [proof::camera()];
        let wanted = Wanted::All;
        let asked = Asked { renderer: &mut renderer, placed: proof::placed(), cameras: &cameras, wanted };
        let drawn = together::draw(&mut [asked])?;
        if !drawn.iter().flatten().all(proof::accepts) {
            return Err(GpuError::Wrong { name: gpu.name.clone() });
        }
        Ok(gpu)
    });
    opened.clone()
}

impl GpuRenderer {
    fn new(gpu: Arc<Gpu>, scenery: Scenery) -> GpuRenderer {
        let prepared = lit(scenery);
        let lamps = prepared.scenery.lamps.as_ref().map_or(1, |lamps| lamps.lamps.len().max(1));
        let (scene, shadow) = (SceneBuffers::new(&gpu, &prepared), shadow_maps(&gpu, lamps as u32));
        GpuRenderer {
            gpu,
            prepared,
            scene,
            shadow,
            placed: None,
            contact: ContactMap::default(),
            targets: None,
            pictures: None,
            embedded: None,
        }
    }

    /// Uploads the poses of all parts. Returns true if they changed.
    fn place(&mut self, placed: &PlacedScenery) -> bool {
        let moved = self.placed.as_ref() != Some(placed);
        if moved {
            let GpuRenderer { gpu, prepared, scene, contact, .. } = self;
            contact.draw(prepared, placed);
            scene.place(gpu, prepared, placed, contact);
            self.placed = Some(placed.clone());
        }
        moved
    }

    /// Encodes the shadow that all views of a state share; there must be at least one view.
    fn encode_shadow(&self, encoder: &mut CommandEncoder) {
        let lights = self.placed.iter().flat_map(|placed| &placed.lights);
        let mut casting: Vec<_> = lights
            .enumerate()
            .filter(|(_, light)| light.casts_shadow)
            .map(|(number, _)| (number, self.scene.lamp_group(number)))
            .collect();
        if self.prepared.scenery.lamps.is_none() {
            casting = vec![(0, self.scene.group(0))];
        }
        for (layer, group) in casting {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                depth_stencil_attachment: Some(nearest(&self.shadow.layers[layer])),
                ..RenderPassDescriptor::default()
            });
            pass.set_pipeline(&self.gpu.passes.shadow);
            pass.set_bind_group(0, group, &[]);
            pass.draw(0..self.scene.corners, 0..1);
        }
    }

    /// Encodes the image of a view, which goes to `region` of the buffer of all images.
    fn encode(&mut self, encoder: &mut CommandEncoder, view: usize, region: &Region, drawn: &Buffer) {
        let size_px = [region.width, region.height];
        if !self.targets.as_ref().is_some_and(|targets| targets.fit(size_px, region.bytes, drawn)) {
            let has_veils = self.prepared.is_veil.contains(&true);
            let shadow = &self.shadow.all;
            self.targets = Some(Targets::new(&self.gpu, shadow, size_px, region.bytes, drawn, has_veils));
        }
        let Some(Targets { samples, centres, veils, group, .. }) = &self.targets else { return };
        let (passes, scene) = (&self.gpu.passes, self.scene.group(view));
        let (layers, resolve): (&[&Attachments], _) = match region.wanted {
            Wanted::All => (&[samples, centres], &passes.resolve),
            Wanted::Colours => (&[samples], &passes.resolve_colours),
        };
        for attachments in layers {
            let mut pass = marking(encoder, attachments);
            pass.set_pipeline(&passes.triangles);
            pass.set_bind_group(0, scene, &[]);
            pass.draw(0..self.scene.corners, 0..1);
        }
        for (number, layer) in veils.iter().take(layers.len()).flat_map(|layers| layers.iter().enumerate()) {
            let mut pass = marking(encoder, &layer.attachments);
            pass.set_pipeline(if number == 0 { &passes.first_veils } else { &passes.next_veils });
            pass.set_bind_group(0, scene, &[]);
            pass.set_bind_group(2, &layer.peel, &[]);
            pass.draw(0..self.scene.corners, 0..1);
        }
        let mut pass = encoder.begin_compute_pass(&Default::default());
        pass.set_pipeline(resolve);
        pass.set_bind_group(0, scene, &[]);
        pass.set_bind_group(1, group, &[region.offset as u32]);
        pass.dispatch_workgroups(region.width.div_ceil(GROUP), region.height.div_ceil(GROUP), 1);
    }

    /// Renders the image of each camera. Returns `None` if the device fails or has failed before: the
    /// embedded renderer has to draw then.
    fn draw(&mut self, step: &Step, cameras: &[Camera], wanted: Wanted) -> Option<Vec<Frame>> {
        if self.embedded.is_some() {
            return None;
        }
        let placed = self.prepared.scenery.place(step);
        let drawn = together::draw(&mut [Asked { renderer: self, placed, cameras, wanted }]);
        let frames = drawn.map(|frames| frames.into_iter().flatten().collect());
        let warn = |error: &GpuError| {
            tracing::warn!("pictures are drawn by the embedded renderer from now on: {error}")
        };
        frames.inspect_err(warn).ok()
    }

    fn embedded(&mut self) -> &mut dyn Renderer {
        &mut **self.embedded.get_or_insert_with(|| cpu(self.prepared.scenery.clone()))
    }
}

/// Begins a pass that writes the numbers of triangles.
fn marking<'a>(
    encoder: &'a mut CommandEncoder,
    Attachments { triangles, depth }: &Attachments,
) -> RenderPass<'a> {
    let nothing = Color { r: f64::from(NOTHING), ..Color::BLACK };
    encoder.begin_render_pass(&RenderPassDescriptor {
        color_attachments: &[Some(RenderPassColorAttachment {
            view: triangles,
            depth_slice: None,
            resolve_target: None,
            ops: Operations { load: LoadOp::Clear(nothing), store: StoreOp::Store },
        })],
        depth_stencil_attachment: Some(nearest(depth)),
        ..RenderPassDescriptor::default()
    })
}

/// Returns an attachment that keeps the nearest surface. Depths are inverse distances, and start at 0.
fn nearest(depth: &TextureView) -> RenderPassDepthStencilAttachment<'_> {
    RenderPassDepthStencilAttachment {
        view: depth,
        depth_ops: Some(Operations { load: LoadOp::Clear(0.0), store: StoreOp::Store }),
        stencil_ops: None,
    }
}

impl Renderer for GpuRenderer {
    fn name(&self) -> &str {
        self.embedded.as_ref().map_or(&self.gpu.name, |embedded| embedded.name())
    }

    fn render_all(&mut self, step: &Step, cameras: &[Camera]) -> Vec<Frame> {
        match self.draw(step, cameras, Wanted::All) {
            Some(frames) => frames,
            None => self.embedded().render_all(step, cameras),
        }
    }

    fn render_colours(&mut self, step: &Step, camera: &Camera) -> Vec<u8> {
        match self.draw(step, slice::from_ref(camera), Wanted::Colours) {
            Some(mut frames) => frames.swap_remove(0).rgb,
            None => self.embedded().render_colours(step, camera),
        }
    }

    fn draws_together(&self) -> bool {
        self.embedded.is_none()
    }

    fn on_gpu(&mut self) -> Option<&mut GpuRenderer> {
        self.embedded.is_none().then_some(self)
    }
}
