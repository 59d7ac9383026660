//! The passes of an image: shadow, samples, centres, and the mean of the samples.

use wgpu::{
    BindGroupLayout, BindGroupLayoutDescriptor, BindGroupLayoutEntry, BindingType, BufferBindingType,
    ColorTargetState, CompareFunction, ComputePipeline, ComputePipelineDescriptor, DepthStencilState, Device,
    Face, FragmentState, PipelineLayout, PipelineLayoutDescriptor, PrimitiveState, RenderPipeline,
    RenderPipelineDescriptor, ShaderModule, ShaderModuleDescriptor, ShaderSource, ShaderStages,
    TextureFormat, TextureSampleType, TextureViewDimension, VertexState,
};

use super::shader;

pub(super) const DEPTH: TextureFormat = TextureFormat::Depth32Float;
/// Format of triangle numbers.
pub(super) const TRIANGLES: TextureFormat = TextureFormat::R32Uint;

/// Number of storage buffers of a scene.
const SCENE_BUFFERS: usize = 7;

pub(super) struct Passes {
    /// Bindings of the scene and the view.
    pub scene: BindGroupLayout,
    /// Bindings of the first passes' results and of the image's destination.
    pub targets: BindGroupLayout,
    /// Bindings of the nearness of solid surfaces, and of the previous layer of blended ones.
    pub peel: BindGroupLayout,
    pub shadow: RenderPipeline,
    /// Pass over samples, and over centres.
    pub triangles: RenderPipeline,
    /// Pass over the nearest blended surfaces, and over those behind them.
    pub first_veils: RenderPipeline,
    pub next_veils: RenderPipeline,
    pub resolve: ComputePipeline,
    /// The same pass without depths and ids.
    pub resolve_colours: ComputePipeline,
}

impl Passes {
    pub(super) fn new(device: &Device) -> Passes {
        let module = device.create_shader_module(ShaderModuleDescriptor {
            label: None,
            source: ShaderSource::Wgsl(shader::text().into()),
        });
        let all = ShaderStages::VERTEX_FRAGMENT | ShaderStages::COMPUTE;
        let storage = |read_only| buffer(BufferBindingType::Storage { read_only });
        let mut of_scene = vec![buffer(BufferBindingType::Uniform)];
        of_scene.extend([storage(true); SCENE_BUFFERS]);
        let scene = layout(device, all, &of_scene);
        let targets = layout(
            device,
            ShaderStages::COMPUTE,
            &[
                texture(TextureSampleType::Depth, TextureViewDimension::D2Array),
                texture(TextureSampleType::Uint, TextureViewDimension::D2),
                texture(TextureSampleType::Uint, TextureViewDimension::D2),
                // Offset of this image in the buffer of all images.
                BindingType::Buffer {
                    ty: BufferBindingType::Storage { read_only: false },
                    has_dynamic_offset: true,
                    min_binding_size: None,
                },
                texture(TextureSampleType::Uint, TextureViewDimension::D2Array),
                texture(TextureSampleType::Uint, TextureViewDimension::D2Array),
            ],
        );
        let depth = texture(TextureSampleType::Depth, TextureViewDimension::D2);
        let peel = layout(device, ShaderStages::FRAGMENT, &[depth, depth]);
        let pipeline_layout = |groups: &[Option<&BindGroupLayout>]| {
            device.create_pipeline_layout(&PipelineLayoutDescriptor {
                bind_group_layouts: groups,
                ..PipelineLayoutDescriptor::default()
            })
        };
        let drawing = pipeline_layout(&[Some(&scene)]);
        let resolving = pipeline_layout(&[Some(&scene), Some(&targets)]);
        let peeling = pipeline_layout(&[Some(&scene), None, Some(&peel)]);
        let resolve = |entry_point: &str| {
            device.create_compute_pipeline(&ComputePipelineDescriptor {
                label: None,
                layout: Some(&resolving),
                module: &module,
                entry_point: Some(entry_point),
                compilation_options: Default::default(),
                cache: None,
            })
        };
        Passes {
            shadow: render_pipeline(device, &drawing, &module, "cast_shadow", None),
            triangles: render_pipeline(device, &drawing, &module, "see", Some("mark")),
            first_veils: render_pipeline(device, &peeling, &module, "see_veils", Some("mark_first")),
            next_veils: render_pipeline(device, &peeling, &module, "see_veils", Some("mark_next")),
            resolve: resolve("resolve"),
            resolve_colours: resolve("resolve_colours"),
            scene,
            targets,
            peel,
        }
    }
}

fn buffer(ty: BufferBindingType) -> BindingType {
    BindingType::Buffer { ty, has_dynamic_offset: false, min_binding_size: None }
}

fn texture(sample_type: TextureSampleType, view_dimension: TextureViewDimension) -> BindingType {
    BindingType::Texture { sample_type, view_dimension, multisampled: false }
}

/// Creates a layout with bindings numbered in their order.
fn layout(device: &Device, visibility: ShaderStages, types: &[BindingType]) -> BindGroupLayout {
    let entries: Vec<BindGroupLayoutEntry> = (0..)
        .zip(types)
        .map(|(binding, ty)| BindGroupLayoutEntry { binding, visibility, ty: *ty, count: None })
        .collect();
    device.create_bind_group_layout(&BindGroupLayoutDescriptor { label: None, entries: &entries })
}

/// Creates a pipeline that draws front faces, the greatest depth first: depths are nearness. Corners
/// come from the scene, not from vertex buffers.
fn render_pipeline(
    device: &Device,
    layout: &PipelineLayout,
    module: &ShaderModule,
    vertex: &str,
    fragment: Option<&str>,
) -> RenderPipeline {
    let targets = [Some(ColorTargetState::from(TRIANGLES))];
    device.create_render_pipeline(&RenderPipelineDescriptor {
        label: None,
        layout: Some(layout),
        vertex: VertexState {
            module,
            entry_point: Some(vertex),
            compilation_options: Default::default(),
            buffers: &[],
        },
        primitive: PrimitiveState { cull_mode: Some(Face::Back), ..PrimitiveState::default() },
        depth_stencil: Some(DepthStencilState {
            format: DEPTH,
            depth_write_enabled: Some(true),
            depth_compare: Some(CompareFunction::Greater),
            stencil: Default::default(),
            bias: Default::default(),
        }),
        multisample: Default::default(),
        fragment: fragment.map(|entry_point| FragmentState {
            module,
            entry_point: Some(entry_point),
            compilation_options: Default::default(),
            targets: &targets,
        }),
        multiview_mask: None,
        cache: None,
    })
}
