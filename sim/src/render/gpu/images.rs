//! Images on surfaces, as a device's memory has them.

use std::sync::Arc;

use rapier3d::math::Vector;

use crate::mjcf::TextureLevel;
use crate::render::scene::prepared::Prepared;
use crate::render::shading::image::Image;
use crate::render::shading::lanes::Affine;

/// Count of numbers in `picture.wgsl`'s `Coordinates`, and in the head of an image.
const COORDINATE_NUMBERS: usize = 12;
const HEAD_NUMBERS: usize = 4;

/// Contents of the buffers of images.
pub(super) struct SceneImages {
    /// `Coordinates` of each triangle; empty if no part has an image.
    pub coordinates: Vec<[u32; COORDINATE_NUMBERS]>,
    /// Heads and texels of all images, after a number without meaning.
    pub texels: Vec<u32>,
    /// Index of the head of each part's image in `texels`; 0 without an image.
    pub heads: Vec<u32>,
    /// The same for the sky.
    pub sky_head: u32,
}

impl SceneImages {
    /// Collects the images of a scenery. If they have more than `max_bytes` bytes, their largest levels are
    /// left out.
    pub(super) fn of(prepared: &Prepared, max_bytes: u64) -> SceneImages {
        let mut images: Vec<&Image> = Vec::new();
        for image in prepared.images.iter().flatten().chain(&prepared.sky) {
            if !images.iter().any(|other| is_same(other, image)) {
                images.push(image);
            }
        }
        let size_of_all = |left_out: usize| {
            let numbers = |image: &&Image| {
                HEAD_NUMBERS + kept(image, left_out).iter().map(|level| level.texels.len()).sum::<usize>()
            };
            size_of::<u32>() as u64 * images.iter().map(numbers).sum::<usize>() as u64
        };
        let most_levels = images.iter().map(|image| image.texture.levels.len()).max().unwrap_or(0);
        let left_out = (0..most_levels).find(|left_out| size_of_all(*left_out) < max_bytes);
        let (mut texels, mut placed) = (vec![0], Vec::new());
        for image in images {
            placed.push((image, texels.len() as u32));
            let levels = kept(image, left_out.unwrap_or(most_levels));
            let [width, height] = [levels[0].width, levels[0].height].map(|side| side as u32);
            let faces = if image.is_cube { image.texture.images() } else { 0 };
            texels.extend([width, height, levels.len() as u32, faces as u32]);
            texels.extend(
                levels.iter().flat_map(|level| &level.texels).map(|texel| u32::from_le_bytes(*texel)),
            );
        }
        let head =
            |image: &Image| placed.iter().find(|(other, _)| is_same(other, image)).map(|(_, head)| *head);
        let heads = prepared.images.iter().map(|image| image.as_ref().and_then(head).unwrap_or(0)).collect();
        let sky_head = prepared.sky.as_ref().and_then(head).unwrap_or(0);
        SceneImages { coordinates: coordinates(prepared), texels, heads, sky_head }
    }
}

fn is_same(one: &Image, other: &Image) -> bool {
    Arc::ptr_eq(&one.texture, &other.texture) && one.is_cube == other.is_cube
}

/// Returns the levels of an image without the largest ones; the last one always stays.
fn kept(image: &Image, left_out: usize) -> &[TextureLevel] {
    let levels = &image.texture.levels;
    &levels[left_out.min(levels.len() - 1)..]
}

/// Returns the gradient of each triangle's three image coordinates in its mesh's frame, with their value
/// at the first corner.
fn coordinates(prepared: &Prepared) -> Vec<[u32; COORDINATE_NUMBERS]> {
    if prepared.images.iter().all(Option::is_none) {
        return Vec::new();
    }
    let mut found = Vec::with_capacity(prepared.sheet_of.len());
    for (number, part) in prepared.scenery.parts.iter().enumerate() {
        let of_part = prepared.images[number].as_ref().and_then(|image| image.from_mesh);
        for (corners, sheet) in part.mesh.triangles.iter().zip(prepared.sheets_of(number)) {
            let uv = prepared.sheets[*sheet as usize].uv;
            let Affine(rows) = uv.map(|uv| uv.affine()).or(of_part).unwrap_or_default();
            let corner_m: Vector = part.mesh.vertices[corners[0] as usize].position_m;
            let mut numbers = [0; COORDINATE_NUMBERS];
            for (four, (along, constant)) in numbers.as_chunks_mut::<4>().0.iter_mut().zip(rows) {
                let at_corner = along.dot(corner_m) + constant;
                *four = [along.x, along.y, along.z, at_corner].map(f32::to_bits);
            }
            found.push(numbers);
        }
    }
    found
}
