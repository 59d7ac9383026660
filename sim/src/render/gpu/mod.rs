//! The renderer on a graphics processor, by wgpu. It draws what the embedded renderer draws, in the same steps: which triangle
//! each sample sees, then the colours of those; the two check each other.

mod device;
mod passes;
mod proof;
mod scene;
mod shader;
mod targets;
#[cfg(test)]
mod tests;

use std::sync::{Arc, OnceLock};

use wgpu::{
    Color, CommandEncoder, LoadOp, MapMode, Operations, RenderPassColorAttachment,
    RenderPassDepthStencilAttachment, RenderPassDescriptor, StoreOp, TextureView,
};

use crate::Step;
use crate::render::blur::blurred;
use crate::render::cpu::contact::ContactMap;
use crate::render::scene::prepared::{NOTHING, Prepared};
use crate::render::{Camera, Frame, PlacedScenery, Renderer, Scenery, cpu};
use device::{Gpu, GpuError};
use scene::SceneBuffers;
use targets::{Attachments, Targets};

/// Name of the device that draws.
pub(super) fn name() -> Result<String, GpuError> {
    Ok(open()?.name.clone())
}

pub(super) fn renderer(scenery: Scenery) -> Result<Box<dyn Renderer>, GpuError> {
    Ok(Box::new(GpuRenderer::new(open()?, scenery)))
}

/// Whether there is a graphics processor that is one, not software in its place.
pub(super) fn is_real() -> bool {
    static REAL: OnceLock<bool> = OnceLock::new();
    *REAL.get_or_init(device::is_real)
}

/// Side of the squares of pixels that are resolved together.
const GROUP: u32 = 8;

/// Draws on a graphics processor; if that fails, on the calling thread from then on.
struct GpuRenderer {
    gpu: Arc<Gpu>,
    prepared: Prepared,
    scene: SceneBuffers,
    shadow: TextureView,
    /// Where the parts are in the device's memory, and what the shadow is of.
    placed: Option<PlacedScenery>,
    contact: ContactMap,
    /// Targets of the last picture's size.
    targets: Option<Targets>,
    embedded: Option<Box<dyn Renderer>>,
}

/// The best device that there is, once it has shown that it draws what it should. A process opens it once: that takes
/// longer than many pictures.
fn open() -> Result<Arc<Gpu>, GpuError> {
    static OPENED: OnceLock<Result<Arc<Gpu>, GpuError>> = OnceLock::new();
    let opened = OPENED.get_or_init(|| {
        let gpu = Arc::new(Gpu::open()?);
        let mut renderer = GpuRenderer::new(gpu.clone(), proof::scenery());
        let drawn = renderer.draw(&proof::placed(), &proof::camera())?;
        if !proof::accepts(&drawn) {
            return Err(GpuError::Wrong { name: gpu.name.clone() });
        }
        Ok(gpu)
    });
    opened.clone()
}

impl GpuRenderer {
    fn new(gpu: Arc<Gpu>, scenery: Scenery) -> GpuRenderer {
        let prepared = Prepared::new(scenery);
        let (scene, shadow) = (SceneBuffers::new(&gpu, &prepared), targets::shadow_map(&gpu));
        GpuRenderer {
            gpu,
            prepared,
            scene,
            shadow,
            placed: None,
            contact: ContactMap::default(),
            targets: None,
            embedded: None,
        }
    }

    fn draw(&mut self, placed: &PlacedScenery, camera: &Camera) -> Result<Frame, GpuError> {
        let GpuRenderer { gpu, prepared, scene, shadow, contact, .. } = self;
        let mut encoder = gpu.device.create_command_encoder(&Default::default());
        let targets = match self.targets.take() {
            Some(targets) if (targets.width, targets.height) == (camera.width, camera.height) => targets,
            _ => Targets::new(gpu, shadow, camera.width, camera.height)?,
        };
        if self.placed.as_ref() != Some(placed) {
            contact.draw(prepared, placed);
            scene.place(gpu, prepared, placed, contact);
            self.placed = Some(placed.clone());
        }
        scene.look(gpu, prepared, placed, contact, camera);
        self.encode(&mut encoder, &targets);
        self.gpu.queue.submit([encoder.finish()]);
        let frame = self.read(&targets)?;
        self.targets = Some(targets);
        Ok(Frame { rgb: blurred(frame.rgb, camera), ..frame })
    }

    /// All that the device does for a picture.
    fn encode(&self, encoder: &mut CommandEncoder, targets: &Targets) {
        let passes = &self.gpu.passes;
        let Targets { width, height, ref samples, ref centres, ref picture, ref readable, ref group } =
            *targets;
        {
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                depth_stencil_attachment: Some(nearest(&self.shadow)),
                ..RenderPassDescriptor::default()
            });
            pass.set_pipeline(&passes.shadow);
            pass.set_bind_group(0, &self.scene.group, &[]);
            pass.draw(0..self.scene.corners, 0..1);
        }
        for Attachments { triangles, depth } in [samples, centres] {
            let nothing = Color { r: f64::from(NOTHING), ..Color::BLACK };
            let mut pass = encoder.begin_render_pass(&RenderPassDescriptor {
                color_attachments: &[Some(RenderPassColorAttachment {
                    view: triangles,
                    depth_slice: None,
                    resolve_target: None,
                    ops: Operations { load: LoadOp::Clear(nothing), store: StoreOp::Store },
                })],
                depth_stencil_attachment: Some(nearest(depth)),
                ..RenderPassDescriptor::default()
            });
            pass.set_pipeline(&passes.triangles);
            pass.set_bind_group(0, &self.scene.group, &[]);
            pass.draw(0..self.scene.corners, 0..1);
        }
        {
            let mut pass = encoder.begin_compute_pass(&Default::default());
            pass.set_pipeline(&passes.resolve);
            pass.set_bind_group(0, &self.scene.group, &[]);
            pass.set_bind_group(1, group, &[]);
            pass.dispatch_workgroups(width.div_ceil(GROUP), height.div_ceil(GROUP), 1);
        }
        encoder.copy_buffer_to_buffer(picture, 0, readable, 0, picture.size());
    }

    /// Waits for the picture.
    fn read(&self, targets: &Targets) -> Result<Frame, GpuError> {
        targets.readable.map_async(MapMode::Read, .., |_| ());
        self.gpu.settle()?;
        let mapped =
            targets.readable.get_mapped_range(..).map_err(|error| self.gpu.unusable(error.to_string()))?;
        let numbers = mapped.as_chunks::<4>().0;
        let pixels = numbers.len() / 3;
        let number = |bytes: &[u8; 4]| u32::from_ne_bytes(*bytes);
        let frame = Frame {
            width: targets.width,
            height: targets.height,
            rgb: numbers[..pixels]
                .iter()
                .map(number)
                .flat_map(|rgb| [rgb, rgb >> 8, rgb >> 16].map(|c| c as u8))
                .collect(),
            depth_m: numbers[pixels..2 * pixels].iter().map(number).map(f32::from_bits).collect(),
            ids: numbers[2 * pixels..].iter().map(number).collect(),
        };
        drop(mapped);
        targets.readable.unmap();
        Ok(frame)
    }
}

/// Keeps what is nearest: depths are nearness, and begin with none.
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
        if let Some(embedded) = &mut self.embedded {
            return embedded.render_all(step, cameras);
        }
        let placed = self.prepared.scenery.place(step);
        let drawn: Result<_, _> = cameras.iter().map(|camera| self.draw(&placed, camera)).collect();
        drawn.unwrap_or_else(|error| {
            tracing::warn!("pictures are drawn by the embedded renderer from now on: {error}");
            self.embedded.insert(cpu(self.prepared.scenery.clone())).render_all(step, cameras)
        })
    }
}
