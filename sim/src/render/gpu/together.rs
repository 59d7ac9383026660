//! Images of several worlds, drawn by the device in one submission and read back at once: many images
//! share the cost of a submission and a wait.

use wgpu::{Buffer, CommandEncoder, MapMode};

use super::GpuRenderer;
use super::device::{Gpu, GpuError};
use super::targets::{ALIGNMENT_BYTES, PictureBuffers, check_size};
use crate::render::blur::blurred;
use crate::render::{Camera, Frame, PlacedScenery, RenderRequest, Wanted};

/// Request to one renderer.
pub(super) struct Asked<'a> {
    pub renderer: &'a mut GpuRenderer,
    pub placed: PlacedScenery,
    pub cameras: &'a [Camera],
    pub wanted: Wanted,
}

/// Region of an image in the buffer of all images.
pub(super) struct Region {
    pub width: u32,
    pub height: u32,
    camera: Camera,
    pub wanted: Wanted,
    pub offset: u64,
    pub bytes: u64,
}

/// Returns the colours for all requests. Returns `None` if a renderer is not on the device, or the
/// device fails.
pub fn colours(requests: &mut [RenderRequest]) -> Option<Vec<Vec<Vec<u8>>>> {
    let asked = requests.iter_mut().map(|request| {
        let renderer = request.renderer.on_gpu()?;
        let placed = renderer.prepared.scenery.place(request.step);
        Some(Asked { renderer, placed, cameras: &request.cameras, wanted: Wanted::Colours })
    });
    let frames = draw(&mut asked.collect::<Option<Vec<_>>>()?).ok()?;
    Some(frames.into_iter().map(|frames| frames.into_iter().map(|frame| frame.rgb).collect()).collect())
}

/// Renders the image of each camera, renderer by renderer. After an error, every renderer counts as not
/// having drawn.
pub(super) fn draw(asked: &mut [Asked]) -> Result<Vec<Vec<Frame>>, GpuError> {
    let Some(first) = asked.first() else { return Ok(Vec::new()) };
    let gpu = first.renderer.gpu.clone();
    for camera in asked.iter().flat_map(|one| one.cameras) {
        check_size(&gpu, [camera.width, camera.height])?;
    }
    let (regions, bytes) = regions(asked);
    if bytes > gpu.device.limits().max_buffer_size && asked.len() > 1 {
        let (some, others) = asked.split_at_mut(asked.len() / 2);
        let mut frames = draw(some)?;
        frames.extend(draw(others)?);
        return Ok(frames);
    }
    if bytes == 0 {
        return Ok(asked.iter().map(|_| Vec::new()).collect());
    }
    let pictures = asked[0].renderer.pictures.take().filter(|pictures| pictures.drawn.size() >= bytes);
    let pictures = pictures.unwrap_or_else(|| PictureBuffers::new(&gpu, bytes));
    let mut encoder = gpu.device.create_command_encoder(&Default::default());
    for (one, regions) in asked.iter_mut().zip(&regions) {
        one.encode(&mut encoder, regions, &pictures.drawn);
    }
    encoder.copy_buffer_to_buffer(&pictures.drawn, 0, &pictures.readable, 0, bytes);
    gpu.queue.submit([encoder.finish()]);
    let frames = read(&gpu, &pictures.readable, &regions, bytes);
    match &frames {
        Ok(_) => asked[0].renderer.pictures = Some(pictures),
        Err(_) => asked.iter_mut().for_each(|one| one.renderer.placed = None),
    }
    #[cfg(test)]
    counts::SUBMISSIONS.set(counts::SUBMISSIONS.get() + 1);
    frames
}

impl Asked<'_> {
    fn encode(&mut self, encoder: &mut CommandEncoder, regions: &[Region], drawn: &Buffer) {
        let Asked { renderer, placed, cameras, .. } = self;
        let moved = renderer.place(placed);
        for (view, camera) in cameras.iter().enumerate() {
            let GpuRenderer { gpu, prepared, scene, contact, .. } = &mut **renderer;
            scene.look(gpu, view, prepared, placed, contact, camera);
        }
        if moved && !cameras.is_empty() {
            renderer.encode_shadow(encoder);
        }
        for (view, region) in regions.iter().enumerate() {
            renderer.encode(encoder, view, region, drawn);
        }
    }
}

/// Returns the regions of all images, renderer by renderer, and their total number of bytes.
fn regions(asked: &[Asked]) -> (Vec<Vec<Region>>, u64) {
    let mut end = 0;
    let mut region = |camera: &Camera, wanted: Wanted| {
        let Camera { width, height, .. } = *camera;
        let numbers = match wanted {
            Wanted::All => 3,
            Wanted::Colours => 1,
        };
        let bytes = u64::from(width) * u64::from(height) * numbers * size_of::<u32>() as u64;
        let offset = end;
        end = (end + bytes).next_multiple_of(ALIGNMENT_BYTES);
        Region { width, height, camera: *camera, wanted, offset, bytes }
    };
    let regions = asked
        .iter()
        .map(|one| one.cameras.iter().map(|camera| region(camera, one.wanted)).collect())
        .collect();
    (regions, end)
}

/// Waits for all images and reads them.
fn read(
    gpu: &Gpu,
    readable: &Buffer,
    regions: &[Vec<Region>],
    bytes: u64,
) -> Result<Vec<Vec<Frame>>, GpuError> {
    readable.map_async(MapMode::Read, ..bytes, |_| ());
    gpu.settle()?;
    let mapped = readable.get_mapped_range(..bytes).map_err(|error| gpu.unusable(error.to_string()))?;
    let frames =
        regions.iter().map(|regions| regions.iter().map(|region| frame(&mapped, region)).collect()).collect();
    drop(mapped);
    readable.unmap();
    #[cfg(test)]
    counts::READ_BACKS.set(counts::READ_BACKS.get() + 1);
    Ok(frames)
}

fn frame(mapped: &[u8], region: &Region) -> Frame {
    let numbers = mapped[region.offset as usize..][..region.bytes as usize].as_chunks::<4>().0;
    let pixels = region.width as usize * region.height as usize;
    let (colours, measured) = numbers.split_at(pixels);
    let (depths, ids) = measured.split_at(measured.len() / 2);
    let mut rgb = vec![0; 3 * pixels];
    for (rgb, colour) in rgb.as_chunks_mut::<3>().0.iter_mut().zip(colours) {
        let [r, g, b, _] = u32::from_ne_bytes(*colour).to_le_bytes();
        *rgb = [r, g, b];
    }
    Frame {
        width: region.width,
        height: region.height,
        rgb: blurred(rgb, &region.camera),
        depth_m: depths.iter().map(|bytes| f32::from_ne_bytes(*bytes)).collect(),
        ids: ids.iter().map(|bytes| u32::from_ne_bytes(*bytes)).collect(),
    }
}

/// Counters of this thread's requests to the device.
#[cfg(test)]
pub(super) mod counts {
    use std::cell::Cell;

    thread_local! {
        pub static SUBMISSIONS: Cell<u32> = const { Cell::new(0) };
        pub static READ_BACKS: Cell<u32> = const { Cell::new(0) };
    }
}
