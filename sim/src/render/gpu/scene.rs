//! A scenery in GPU memory, and its poses in one state.

use rapier3d::math::{Matrix, Pose, Vector};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::baked;
use super::device::Gpu;
use super::images::{PartHeads, SceneImages};
use super::targets::bind;
use crate::mjcf::{FileLight, Gloss, LightKind, MAX_LIGHTS};
use crate::render::cpu::contact::ContactMap;
use crate::render::scene::bend::Bend;
use crate::render::scene::prepared::{NOTHING, Prepared};
use crate::render::shading::lamps::{lamp_map, lamp_view, tilted};
use crate::render::shading::power::linear_value;
use crate::render::shading::{CONTACT_TEXELS, SAMPLES, TEXELS, VEILS, normal_offset_m, sun_map};
use crate::render::{Camera, Carrier, Part, Pattern, PlacedScenery, Scenery};

/// Number of vectors in `picture.wgsl`'s `View` before its counts.
const CAMERA_VECTORS: usize = 16;
/// Number of words in `View`, and in `Part`.
const VIEW_NUMBERS: usize = 4 * CAMERA_VECTORS + 5 * 4 + MAX_LIGHTS * LAMP_NUMBERS;
const PART_NUMBERS: usize = 36;
/// Number of words in `Lamp`.
const LAMP_NUMBERS: usize = 36;
/// Bits of `Part`'s flags.
const CASTS_SHADOW: u32 = 1;
const IS_VEIL: u32 = 2;
const IS_CUT_OUT: u32 = 4;
const HAS_ALPHA: u32 = 8;

/// Bind group 0 of `picture.wgsl`, once for each view that is drawn at the same time.
pub(super) struct SceneBuffers {
    corner_numbers: Buffer,
    faces: Buffer,
    parts: Buffer,
    contacts: Buffer,
    coordinates: Buffer,
    texels: Buffer,
    baked: Buffer,
    /// Indices of the heads of each part's images in `texels`.
    heads: Vec<PartHeads>,
    sky_head: u32,
    views: Vec<SceneView>,
    /// Views of the lamps that cast shadows.
    lamps: Vec<SceneView>,
    /// Number of corners of all triangles.
    pub corners: u32,
}

/// Uniforms of a camera, and the scene's bind group for this camera.
struct SceneView {
    numbers: Buffer,
    group: BindGroup,
}

impl SceneBuffers {
    pub(super) fn new(gpu: &Gpu, prepared: &Prepared) -> SceneBuffers {
        let parts = prepared.scenery.parts.iter();
        let corners: Vec<[u32; 4]> =
            parts.zip(0..).flat_map(|(part, number)| part_corners(part, number)).collect();
        let triangles = prepared.patch_of.iter().zip(corners.iter().step_by(3));
        let faces: Vec<u32> = triangles
            .flat_map(|(patch, corner)| {
                let bend = face(prepared.patches[*patch as usize].bend, *corner);
                bend.into_iter().chain(baked::face_numbers(prepared, *patch))
            })
            .collect();
        let images = SceneImages::of(prepared, gpu.device.limits().max_storage_buffer_binding_size);
        let written = BufferUsages::COPY_DST | BufferUsages::STORAGE;
        SceneBuffers {
            corner_numbers: initialised(gpu, corners.as_flattened(), BufferUsages::STORAGE),
            faces: initialised(gpu, &faces, BufferUsages::STORAGE),
            parts: initialised(gpu, &vec![0; prepared.scenery.parts.len() * PART_NUMBERS], written),
            contacts: initialised(gpu, &vec![0; 2 * CONTACT_TEXELS * CONTACT_TEXELS], written),
            coordinates: initialised(gpu, images.coordinates.as_flattened(), BufferUsages::STORAGE),
            texels: initialised(gpu, &images.texels, BufferUsages::STORAGE),
            baked: initialised(gpu, &bits(baked::numbers(prepared).as_flattened()), written),
            heads: images.heads,
            sky_head: images.sky_head,
            views: Vec::new(),
            lamps: Vec::new(),
            corners: corners.len() as u32,
        }
    }

    /// Returns the scene's bindings for the view with this number.
    pub(super) fn group(&self, view: usize) -> &BindGroup {
        &self.views[view].group
    }

    /// Returns the scene's bindings for the shadows of the lamp with this number.
    pub(super) fn lamp_group(&self, lamp: usize) -> &BindGroup {
        &self.lamps[lamp].group
    }

    fn new_view(&self, gpu: &Gpu) -> SceneView {
        let usage = BufferUsages::COPY_DST | BufferUsages::UNIFORM;
        let numbers = initialised(gpu, &[0; VIEW_NUMBERS], usage);
        let buffers = [
            &numbers,
            &self.corner_numbers,
            &self.faces,
            &self.parts,
            &self.contacts,
            &self.coordinates,
            &self.texels,
            &self.baked,
        ];
        let group = bind(gpu, &gpu.passes.scene, buffers.map(|buffer| buffer.as_entire_binding()));
        SceneView { numbers, group }
    }

    /// Uploads the pose of every part.
    pub(super) fn place(&self, gpu: &Gpu, prepared: &Prepared, placed: &PlacedScenery, contact: &ContactMap) {
        let parts = prepared.scenery.parts.iter().zip(&placed.world_from_mesh).enumerate();
        let numbers: Vec<[u32; PART_NUMBERS]> = parts
            .map(|(number, (part, pose))| {
                let (rgb, grain) = (prepared.linear_rgb[number], prepared.grain[number]);
                placed_part(part, *pose, rgb, grain, self.heads[number])
            })
            .collect();
        gpu.queue.write_buffer(&self.parts, 0, &bytes(numbers.as_flattened()));
        if let Some(light) = &prepared.baked {
            let cubes = baked::part_cubes(light, prepared, placed);
            gpu.queue.write_buffer(&self.baked, 0, &bytes(&bits(cubes.as_flattened().as_flattened())));
        }
        gpu.queue.write_buffer(&self.contacts, 0, &bytes(&bits(contact.texel_values.as_flattened())));
    }

    /// Sets the camera of the view `view`, which is an existing index or the next one.
    pub(super) fn look(
        &mut self,
        gpu: &Gpu,
        view: usize,
        prepared: &Prepared,
        placed: &PlacedScenery,
        contact: &ContactMap,
        camera: &Camera,
    ) {
        let rotation = camera.world_from_camera.rotation;
        let sample = 1.0 / (camera.focal_px() * SAMPLES as f32);
        let (width, height) = (camera.width as f32, camera.height as f32);
        let direction = |axis: Vector| [axis.x, axis.y, axis.z, 0.0];
        let light = &prepared.scenery.light;
        let map = sun_map(light.sun_direction, placed.focus_m, prepared.scenery.focus_radius_m);
        let [column, row, nearness] = map.0.map(|(axis, constant)| [axis.x, axis.y, axis.z, constant]);
        let [x_m, y_m] = contact.corner_m;
        let numbers: [[f32; 4]; CAMERA_VECTORS] = [
            direction(rotation * Vector::X),
            direction(rotation * Vector::Y),
            direction(rotation * Vector::Z),
            direction(camera.world_from_camera.translation),
            direction(rotation * camera.unproject([0.0, 0.0], 1.0)),
            direction(rotation * Vector::X * sample),
            direction(rotation * Vector::NEG_Y * sample),
            column,
            row,
            nearness,
            [2.0 * camera.focal_px() / width, 2.0 * camera.focal_px() / height, width, height],
            [x_m, y_m, contact.texels_per_m, 0.0],
            direction(light.sun_rgb),
            direction(light.sun_direction),
            direction(light.below_rgb),
            direction(light.above_rgb),
        ];
        let mut numbers = bits(numbers.as_flattened());
        let lamps = placed.lights.len() as u32;
        let layers = if prepared.is_veil.contains(&true) { VEILS as u32 } else { 0 };
        numbers.extend([lamps, layers, self.sky_head, NOTHING]);
        numbers.extend(bits(lighting(prepared).as_flattened()));
        numbers.extend(placed.lights.iter().zip(0..).flat_map(|(light, number)| {
            lamp(light, number, placed.focus_m, prepared.scenery.focus_radius_m).map(f32::to_bits)
        }));
        numbers.resize(VIEW_NUMBERS, 0);
        if view == self.views.len() {
            let view = self.new_view(gpu);
            self.views.push(view);
        }
        gpu.queue.write_buffer(&self.views[view].numbers, 0, &bytes(&numbers));
        for lamp in 0..lamps {
            if self.lamps.len() == lamp as usize {
                let view = self.new_view(gpu);
                self.lamps.push(view);
            }
            numbers[CASTER] = lamp;
            gpu.queue.write_buffer(&self.lamps[lamp as usize].numbers, 0, &bytes(&numbers));
        }
    }
}

/// Index of the word in `View` for the lamp whose shadow is drawn.
const CASTER: usize = 67;

/// Returns the vectors of `View` from `extra` to the headlight.
fn lighting(prepared: &Prepared) -> [[f32; 4]; 4] {
    let Scenery { lamps, focus_radius_m, .. } = &prepared.scenery;
    let head = lamps.as_ref().map(|lamps| lamps.headlight).unwrap_or_default();
    let rgb = |rgb: Vector| [rgb.x, rgb.y, rgb.z, 0.0];
    let share = |is_so: bool| f32::from(u8::from(is_so));
    [
        [normal_offset_m(*focus_radius_m), share(lamps.is_some()), share(prepared.baked.is_some()), 0.0],
        rgb(head.ambient_rgb),
        rgb(head.diffuse_rgb),
        rgb(head.specular_rgb),
    ]
}

/// Returns the numbers of a `Lamp`.
fn lamp(light: &FileLight, number: u32, focus_m: Vector, radius_m: f32) -> [f32; LAMP_NUMBERS] {
    let kind = match light.kind {
        LightKind::Directional => 0.0,
        LightKind::Spot => 1.0,
        LightKind::Point => 2.0,
    };
    let map = match light.kind {
        LightKind::Directional => sun_map(tilted(-light.direction), focus_m, radius_m),
        LightKind::Spot | LightKind::Point => lamp_map(light),
    };
    let layer = if light.casts_shadow { number as f32 } else { -1.0 };
    let texel_m = 2.0 * (0.5 * lamp_view(light).1).tan() / TEXELS as f32;
    let with = |vector: Vector, fourth: f32| [vector.x, vector.y, vector.z, fourth];
    let [column, row, nearness] = map.0.map(|(axis, constant)| with(axis, constant));
    let rows = [
        with(light.position_m, kind),
        with(light.direction, light.cutoff_rad.cos()),
        with(light.ambient_rgb, light.exponent_value),
        with(light.diffuse_rgb, layer),
        with(light.specular_rgb, texel_m),
        with(Vector::from(light.attenuation_values), 0.0),
        column,
        row,
        nearness,
    ];
    std::array::from_fn(|i| rows.as_flattened()[i])
}

fn initialised(gpu: &Gpu, numbers: &[u32], usage: BufferUsages) -> Buffer {
    // A buffer must not be empty.
    let contents = bytes(if numbers.is_empty() { &[0; 64] } else { numbers });
    gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents: &contents, usage })
}

/// Returns three corners per triangle, with the index of their part.
fn part_corners(part: &Part, number: u32) -> impl Iterator<Item = [u32; 4]> {
    part.mesh.triangles.iter().flatten().map(move |corner| {
        let Vector { x, y, z } = part.mesh.vertices[*corner as usize].position_m;
        [x.to_bits(), y.to_bits(), z.to_bits(), number]
    })
}

/// Returns the normal at a triangle's first corner, and its derivatives.
fn face(bend: Bend, [x, y, z, _]: [u32; 4]) -> [u32; 16] {
    let slope_1_m = bend.slope_1_m.unwrap_or(Matrix::ZERO);
    let corner_m = Vector::from([x, y, z].map(f32::from_bits));
    let [x, y, z] = [slope_1_m.x_axis, slope_1_m.y_axis, slope_1_m.z_axis];
    let mut numbers = [0; 16];
    for (four, vector) in
        numbers.as_chunks_mut::<4>().0.iter_mut().zip([bend.normal + slope_1_m * corner_m, x, y, z])
    {
        *four = [vector.x.to_bits(), vector.y.to_bits(), vector.z.to_bits(), 0];
    }
    numbers
}

fn placed_part(
    part: &Part,
    pose: Pose,
    [first, second]: [Vector; 2],
    grain: usize,
    heads: PartHeads,
) -> [u32; PART_NUMBERS] {
    let (matrix, t) = (Matrix::from_quat(pose.rotation), pose.translation);
    let (x, y, z) = (matrix.row(0), matrix.row(1), matrix.row(2));
    let pattern = match part.pattern {
        Pattern::Plain => 0.0,
        Pattern::Checker(_) => 1.0,
        Pattern::Wood => 2.0,
        Pattern::Fabric => 3.0,
        Pattern::Print => 4.0,
    };
    let rows = [
        [x.x, x.y, x.z, t.x],
        [y.x, y.y, y.z, t.y],
        [z.x, z.y, z.z, t.z],
        [first.x, first.y, first.z, pattern],
        [second.x, second.y, second.z, grain as f32],
        [part.gloss.emission_factor, part.gloss.specular_factor, part.gloss.shininess_factor, part.alpha],
    ];
    let mut numbers = [0; PART_NUMBERS];
    let has_alpha = part.image.as_ref().is_some_and(|image| image.texture.has_alpha);
    let bit = |is_set: bool, bit: u32| if is_set { bit } else { 0 };
    let bits = bit(part.casts_shadow, CASTS_SHADOW)
        | bit(part.is_veil(), IS_VEIL)
        | bit(part.is_cut_out(), IS_CUT_OUT)
        | bit(has_alpha, HAS_ALPHA);
    let flags = [part.id, bits, (part.carrier == Carrier::Room).into(), heads.colour];
    let Gloss { emission_factor, roughness_factor, metallic_factor, .. } = part.gloss;
    let shares = [roughness_factor.unwrap_or(-1.0), metallic_factor].map(f32::to_bits);
    let emitted = [heads.emitted, linear_value(emission_factor).to_bits()];
    let flags = flags.into_iter().chain([heads.gloss, heads.relief]).chain(shares).chain(emitted);
    for (number, bits) in numbers.iter_mut().zip(rows.as_flattened().iter().map(|x| x.to_bits()).chain(flags))
    {
        *number = bits;
    }
    numbers
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|value| value.to_bits()).collect()
}

fn bytes(numbers: &[u32]) -> Vec<u8> {
    numbers.iter().flat_map(|number| number.to_ne_bytes()).collect()
}
