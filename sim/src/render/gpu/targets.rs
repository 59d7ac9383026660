//! Render targets of images, and the buffer from which they are read.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer, BufferBinding,
    BufferDescriptor, BufferSize, BufferUsages, Extent3d, TextureDescriptor, TextureDimension, TextureFormat,
    TextureUsages, TextureView,
};

use super::device::{Gpu, GpuError};
use super::passes::{DEPTH, TRIANGLES};
use crate::render::shading::{SAMPLES, TEXELS};

/// Alignment of images in this buffer, in bytes.
pub(super) const ALIGNMENT_BYTES: u64 = 256;

/// Images of all views that are drawn together: written by the device, and copied from there to memory
/// that the CPU can read.
pub(super) struct PictureBuffers {
    pub drawn: Buffer,
    pub readable: Buffer,
}

/// Render targets for images of one size, drawn one after another.
pub(super) struct Targets {
    pub width: u32,
    pub height: u32,
    /// Size of an image in the buffer.
    bytes: u64,
    drawn: Buffer,
    pub samples: Attachments,
    pub centres: Attachments,
    /// Group 1 of `picture.wgsl`, with the first image in the buffer.
    pub group: BindGroup,
}

/// Triangle numbers and their nearness.
pub(super) struct Attachments {
    pub triangles: TextureView,
    pub depth: TextureView,
}

impl PictureBuffers {
    pub(super) fn new(gpu: &Gpu, size: u64) -> PictureBuffers {
        let buffer = |usage: BufferUsages| {
            gpu.device.create_buffer(&BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        PictureBuffers {
            drawn: buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC),
            readable: buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST),
        }
    }
}

impl Targets {
    /// Allocates targets for images of `bytes` bytes.
    pub(super) fn new(
        gpu: &Gpu,
        shadow: &TextureView,
        [width, height]: [u32; 2],
        bytes: u64,
        drawn: &Buffer,
    ) -> Targets {
        let layer = |samples: u32| Attachments {
            triangles: texture(gpu, TRIANGLES, width * samples, height * samples),
            depth: texture(gpu, DEPTH, width * samples, height * samples),
        };
        let (samples, centres) = (layer(SAMPLES as u32), layer(1));
        let resources = [
            BindingResource::TextureView(shadow),
            BindingResource::TextureView(&samples.triangles),
            BindingResource::TextureView(&centres.triangles),
            BindingResource::Buffer(BufferBinding { buffer: drawn, offset: 0, size: BufferSize::new(bytes) }),
        ];
        let group = bind(gpu, &gpu.passes.targets, resources);
        Targets { width, height, bytes, drawn: drawn.clone(), samples, centres, group }
    }

    /// Returns true if such images can be drawn into these targets.
    pub(super) fn fit(&self, size_px: [u32; 2], bytes: u64, drawn: &Buffer) -> bool {
        ([self.width, self.height], self.bytes) == (size_px, bytes) && self.drawn == *drawn
    }
}

/// Returns an error if the device has no textures of the required size.
pub(super) fn check_size(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<(), GpuError> {
    let most = gpu.device.limits().max_texture_dimension_2d / SAMPLES as u32;
    if width > most || height > most {
        return Err(GpuError::TooLarge { name: gpu.name.clone(), width, height });
    }
    Ok(())
}

/// Creates the shadow's map.
pub(super) fn shadow_map(gpu: &Gpu) -> TextureView {
    texture(gpu, DEPTH, TEXELS as u32, TEXELS as u32)
}

fn texture(gpu: &Gpu, format: TextureFormat, width: u32, height: u32) -> TextureView {
    let texture = gpu.device.create_texture(&TextureDescriptor {
        label: None,
        size: Extent3d { width, height, depth_or_array_layers: 1 },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    });
    texture.create_view(&Default::default())
}

/// Binds resources in their order.
pub(super) fn bind<const N: usize>(
    gpu: &Gpu,
    layout: &BindGroupLayout,
    resources: [BindingResource<'_>; N],
) -> BindGroup {
    let mut number = 0..;
    let entries = resources.map(|resource| BindGroupEntry { binding: number.next().unwrap_or(0), resource });
    gpu.device.create_bind_group(&BindGroupDescriptor { label: None, layout, entries: &entries })
}
