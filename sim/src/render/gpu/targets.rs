//! Render targets of images, and the buffer from which they are read.

use wgpu::{
    BindGroup, BindGroupDescriptor, BindGroupEntry, BindGroupLayout, BindingResource, Buffer, BufferBinding,
    BufferDescriptor, BufferSize, BufferUsages, Extent3d, Texture, TextureDescriptor, TextureDimension,
    TextureFormat, TextureUsages, TextureView, TextureViewDescriptor, TextureViewDimension,
};

use super::device::{Gpu, GpuError};
use super::passes::{DEPTH, TRIANGLES};
use crate::render::shading::{SAMPLES, TEXELS, VEILS};

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
    /// Layers of blended surfaces at samples and at centres; empty if no part is blended.
    pub veils: [Vec<VeilAttachments>; 2],
    /// Bind group 1 of `picture.wgsl`, with the first image in the buffer.
    pub group: BindGroup,
}

/// One layer of blended surfaces.
pub(super) struct VeilAttachments {
    pub attachments: Attachments,
    /// Bind group 2 of `picture.wgsl`.
    pub peel: BindGroup,
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
        has_veils: bool,
    ) -> Targets {
        let layer = |samples: u32| Attachments {
            triangles: one_layer(&texture(gpu, TRIANGLES, width * samples, height * samples, 1), 0),
            depth: one_layer(&texture(gpu, DEPTH, width * samples, height * samples, 1), 0),
        };
        let (samples, centres) = (layer(SAMPLES as u32), layer(1));
        let layers = if has_veils { VEILS as u32 } else { 0 };
        let [(of_samples, all_of_samples), (of_centres, all_of_centres)] =
            [(SAMPLES as u32, &samples), (1, &centres)]
                .map(|(samples, solid)| veil_layers(gpu, solid, [width * samples, height * samples], layers));
        let resources = [
            BindingResource::TextureView(shadow),
            BindingResource::TextureView(&samples.triangles),
            BindingResource::TextureView(&centres.triangles),
            BindingResource::Buffer(BufferBinding { buffer: drawn, offset: 0, size: BufferSize::new(bytes) }),
            BindingResource::TextureView(&all_of_samples),
            BindingResource::TextureView(&all_of_centres),
        ];
        let group = bind(gpu, &gpu.passes.targets, resources);
        let veils = [of_samples, of_centres];
        Targets { width, height, bytes, drawn: drawn.clone(), samples, centres, veils, group }
    }

    /// Returns true if images of this size can be drawn into these targets.
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

/// Shadow maps: all layers together, and each layer alone.
pub(super) struct ShadowMaps {
    pub all: TextureView,
    pub layers: Vec<TextureView>,
}

/// Creates the shadow maps.
pub(super) fn shadow_maps(gpu: &Gpu, layers: u32) -> ShadowMaps {
    let texture = texture(gpu, DEPTH, TEXELS as u32, TEXELS as u32, layers);
    let layers = (0..layers).map(|number| one_layer(&texture, number)).collect();
    ShadowMaps { all: array(&texture), layers }
}

/// Creates layers of blended surfaces in front of solid ones. Returns the layers, and all of their triangle
/// numbers, which are one texel if there is no layer.
fn veil_layers(
    gpu: &Gpu,
    solid: &Attachments,
    [width, height]: [u32; 2],
    layers: u32,
) -> (Vec<VeilAttachments>, TextureView) {
    let (side_x, side_y) = if layers == 0 { (1, 1) } else { (width, height) };
    let triangles = texture(gpu, TRIANGLES, side_x, side_y, layers.max(1));
    let mut found: Vec<VeilAttachments> = Vec::new();
    for number in 0..layers {
        let depth = one_layer(&texture(gpu, DEPTH, width, height, 1), 0);
        let before = found.last().map_or(&solid.depth, |before| &before.attachments.depth);
        let nearness = [&solid.depth, before].map(BindingResource::TextureView);
        let peel = bind(gpu, &gpu.passes.peel, nearness);
        let attachments = Attachments { triangles: one_layer(&triangles, number), depth };
        found.push(VeilAttachments { attachments, peel });
    }
    (found, array(&triangles))
}

/// Returns a view of one layer of a texture.
fn one_layer(texture: &Texture, number: u32) -> TextureView {
    texture.create_view(&TextureViewDescriptor {
        dimension: Some(TextureViewDimension::D2),
        base_array_layer: number,
        array_layer_count: Some(1),
        ..TextureViewDescriptor::default()
    })
}

/// Returns an array view of all layers of a texture, even of a single one.
fn array(texture: &Texture) -> TextureView {
    let dimension = Some(TextureViewDimension::D2Array);
    texture.create_view(&TextureViewDescriptor { dimension, ..TextureViewDescriptor::default() })
}

fn texture(gpu: &Gpu, format: TextureFormat, width: u32, height: u32, layers: u32) -> Texture {
    gpu.device.create_texture(&TextureDescriptor {
        label: None,
        size: Extent3d { width, height, depth_or_array_layers: layers },
        mip_level_count: 1,
        sample_count: 1,
        dimension: TextureDimension::D2,
        format,
        usage: TextureUsages::RENDER_ATTACHMENT | TextureUsages::TEXTURE_BINDING,
        view_formats: &[],
    })
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
