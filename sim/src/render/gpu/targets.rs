//! What pictures of one size are drawn into.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer,
    BufferDescriptor, BufferUsages, Extent3d, TextureDescriptor, TextureDimension, TextureFormat,
    TextureUsages, TextureView,
};

use super::device::{Gpu, GpuError};
use super::passes::{DEPTH, TRIANGLES};
use crate::render::shading::{SAMPLES, TEXELS};

/// Colours, depths and ids, four bytes each.
const BYTES_PER_PIXEL: u64 = 12;

pub(super) struct Targets {
    pub width: u32,
    pub height: u32,
    pub samples: Attachments,
    pub centres: Attachments,
    /// Written by the device, and copied from there to where the processor can read it.
    pub picture: Buffer,
    pub readable: Buffer,
    /// What `picture.wgsl` calls its group 1.
    pub group: BindGroup,
}

/// Triangles, and how near they are.
pub(super) struct Attachments {
    pub triangles: TextureView,
    pub depth: TextureView,
}

impl Targets {
    pub(super) fn new(gpu: &Gpu, shadow: &TextureView, width: u32, height: u32) -> Result<Targets, GpuError> {
        let most = gpu.device.limits().max_texture_dimension_2d / SAMPLES as u32;
        if width > most || height > most {
            return Err(GpuError::TooLarge { name: gpu.name.clone(), width, height });
        }
        let layer = |samples: u32| Attachments {
            triangles: texture(gpu, TRIANGLES, width * samples, height * samples),
            depth: texture(gpu, DEPTH, width * samples, height * samples),
        };
        let (samples, centres) = (layer(SAMPLES as u32), layer(1));
        let buffer = |usage: BufferUsages| {
            let size = u64::from(width) * u64::from(height) * BYTES_PER_PIXEL;
            gpu.device.create_buffer(&BufferDescriptor {
                label: None,
                size,
                usage,
                mapped_at_creation: false,
            })
        };
        let picture = buffer(BufferUsages::STORAGE | BufferUsages::COPY_SRC);
        let readable = buffer(BufferUsages::MAP_READ | BufferUsages::COPY_DST);
        let resources = [
            BindingResource::TextureView(shadow),
            BindingResource::TextureView(&samples.triangles),
            BindingResource::TextureView(&centres.triangles),
            picture.as_entire_binding(),
        ];
        let group = bind(gpu, &gpu.passes.targets, resources);
        Ok(Targets { width, height, samples, centres, picture, readable, group })
    }
}

/// The shadow's map.
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
