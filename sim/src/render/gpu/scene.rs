//! A scenery in a device's memory, and its poses in one state.

use rapier3d::math::{Matrix, Pose, Vector};
use wgpu::util::{BufferInitDescriptor, DeviceExt};
use wgpu::{BindGroup, Buffer, BufferUsages};

use super::device::Gpu;
use super::images::SceneImages;
use super::targets::bind;
use crate::render::cpu::contact::ContactMap;
use crate::render::scene::bend::Bend;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::{CONTACT_TEXELS, SAMPLES, sun_map};
use crate::render::{Camera, Carrier, Part, Pattern, PlacedScenery};

/// Count of numbers in `picture.wgsl`'s `View`, and in its `Part`.
const VIEW_NUMBERS: usize = 64;
const PART_NUMBERS: usize = 24;

/// Group 0 of `picture.wgsl`, once for each view that is drawn at the same time.
pub(super) struct SceneBuffers {
    corner_numbers: Buffer,
    faces: Buffer,
    parts: Buffer,
    contacts: Buffer,
    coordinates: Buffer,
    texels: Buffer,
    /// Index of the head of each part's image in `texels`.
    heads: Vec<u32>,
    views: Vec<SceneView>,
    /// Number of corners of all triangles.
    pub corners: u32,
}

/// Uniforms of a camera, and the scene bound with them.
struct SceneView {
    numbers: Buffer,
    group: BindGroup,
}

impl SceneBuffers {
    pub(super) fn new(gpu: &Gpu, prepared: &Prepared) -> SceneBuffers {
        let parts = prepared.scenery.parts.iter();
        let corners: Vec<[u32; 4]> =
            parts.zip(0..).flat_map(|(part, number)| part_corners(part, number)).collect();
        let bends = prepared.sheet_of.iter().map(|sheet| prepared.sheets[*sheet as usize].bend);
        let firsts = corners.iter().step_by(3);
        let faces: Vec<[u32; 16]> = bends.zip(firsts).map(|(bend, corner)| face(bend, *corner)).collect();
        let images = SceneImages::of(prepared, gpu.device.limits().max_storage_buffer_binding_size);
        let written = BufferUsages::COPY_DST | BufferUsages::STORAGE;
        SceneBuffers {
            corner_numbers: initialised(gpu, corners.as_flattened(), BufferUsages::STORAGE),
            faces: initialised(gpu, faces.as_flattened(), BufferUsages::STORAGE),
            parts: initialised(gpu, &vec![0; prepared.scenery.parts.len() * PART_NUMBERS], written),
            contacts: initialised(gpu, &vec![0; 2 * CONTACT_TEXELS * CONTACT_TEXELS], written),
            coordinates: initialised(gpu, images.coordinates.as_flattened(), BufferUsages::STORAGE),
            texels: initialised(gpu, &images.texels, BufferUsages::STORAGE),
            heads: images.heads,
            views: Vec::new(),
            corners: corners.len() as u32,
        }
    }

    /// Returns the scene's bindings for the view with this number.
    pub(super) fn group(&self, view: usize) -> &BindGroup {
        &self.views[view].group
    }

    fn add_view(&mut self, gpu: &Gpu) {
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
        ];
        let group = bind(gpu, &gpu.passes.scene, buffers.map(|buffer| buffer.as_entire_binding()));
        self.views.push(SceneView { numbers, group });
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
        gpu.queue.write_buffer(&self.contacts, 0, &bytes(&bits(contact.texel_values.as_flattened())));
    }

    /// Sets the camera of the view with this number, which exists or is the next.
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
        let numbers: [[f32; 4]; VIEW_NUMBERS / 4] = [
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
        if view == self.views.len() {
            self.add_view(gpu);
        }
        gpu.queue.write_buffer(&self.views[view].numbers, 0, &bytes(&bits(numbers.as_flattened())));
    }
}

fn initialised(gpu: &Gpu, numbers: &[u32], usage: BufferUsages) -> Buffer {
    // A buffer must not be empty.
    let contents = bytes(if numbers.is_empty() { &[0; 64] } else { numbers });
    gpu.device.create_buffer_init(&BufferInitDescriptor { label: None, contents: &contents, usage })
}

/// Returns three corners a triangle, with the number of their part.
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
    image_head: u32,
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
    ];
    let mut numbers = [0; PART_NUMBERS];
    let flags = [part.id, part.casts_shadow.into(), (part.carrier == Carrier::Room).into(), image_head];
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
