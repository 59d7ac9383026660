//! Layout of surface images in GPU memory.

use std::sync::Arc;

use rapier3d::math::Vector;

use crate::mjcf::{Texture, TextureLevel};
use crate::render::scene::prepared::Prepared;
use crate::render::shading::image::Image;
use crate::render::shading::lanes::Affine;

/// Number of words in `picture.wgsl`'s `Coordinates`, and in the head of an image.
const COORDINATE_NUMBERS: usize = 12;
const HEAD_NUMBERS: usize = 4;

/// Contents of the buffers of images.
pub(super) struct SceneImages {
    /// `Coordinates` of each triangle; empty if no part has an image.
    pub coordinates: Vec<[u32; COORDINATE_NUMBERS]>,
    /// Heads and texels of all images, after one unused word.
    pub texels: Vec<u32>,
    pub heads: Vec<PartHeads>,
    /// Index of the head of the sky's image.
    pub sky_head: u32,
}

/// Indices of the heads of a part's images in [`SceneImages::texels`]; 0 without an image.
#[derive(Clone, Copy, Default)]
pub(super) struct PartHeads {
    pub colour: u32,
    pub gloss: u32,
    pub relief: u32,
    pub emitted: u32,
}

/// A texture, and true if it is mapped to a cube.
type PlacedTexture<'a> = (&'a Arc<Texture>, bool);

impl SceneImages {
    /// Collects the images of a scenery. If they have more than `max_bytes` bytes, their largest levels are
    /// left out.
    pub(super) fn of(prepared: &Prepared, max_bytes: u64) -> SceneImages {
        let mut images: Vec<PlacedTexture> = Vec::new();
        for image in prepared.images.iter().flatten().chain(&prepared.sky).flat_map(textures) {
            if !images.iter().any(|other| is_same(*other, image)) {
                images.push(image);
            }
        }
        let size_of_all = |left_out: usize| {
            let numbers = |(texture, _): &PlacedTexture| {
                HEAD_NUMBERS + kept(texture, left_out).iter().map(|level| level.texels.len()).sum::<usize>()
            };
            size_of::<u32>() as u64 * images.iter().map(numbers).sum::<usize>() as u64
        };
        let most_levels = images.iter().map(|(texture, _)| texture.levels.len()).max().unwrap_or(0);
        let left_out = (0..most_levels).find(|left_out| size_of_all(*left_out) < max_bytes);
        let (mut texels, mut placed) = (vec![0], Vec::new());
        for (texture, is_cube) in images {
            placed.push(((texture, is_cube), texels.len() as u32));
            let levels = kept(texture, left_out.unwrap_or(most_levels));
            let [width, height] = [levels[0].width, levels[0].height].map(|side| side as u32);
            let faces = if is_cube { texture.images() } else { 0 };
            texels.extend([width, height, levels.len() as u32, faces as u32]);
            texels.extend(
                levels.iter().flat_map(|level| &level.texels).map(|texel| u32::from_le_bytes(*texel)),
            );
        }
        let head = |texture: Option<&Arc<Texture>>, is_cube: bool| {
            let mut heads =
                placed.iter().filter(|(other, _)| texture.is_some_and(|one| is_same(*other, (one, is_cube))));
            heads.next().map_or(0, |(_, head)| *head)
        };
        let of_part = |image: &Option<Image>| {
            image.as_ref().map_or(PartHeads::default(), |image| PartHeads {
                colour: head(Some(&image.texture), image.is_cube),
                gloss: head(image.gloss.as_ref(), image.is_cube),
                relief: head(image.relief.as_ref(), image.is_cube),
                emitted: head(image.emitted.as_ref(), image.is_cube),
            })
        };
        let heads = prepared.images.iter().map(of_part).collect();
        let sky_head = prepared.sky.as_ref().map_or(0, |sky| head(Some(&sky.texture), true));
        SceneImages { coordinates: coordinates(prepared), texels, heads, sky_head }
    }
}

/// Returns the textures of an image.
fn textures(image: &Image) -> impl Iterator<Item = PlacedTexture<'_>> {
    let all = [Some(&image.texture), image.gloss.as_ref(), image.relief.as_ref(), image.emitted.as_ref()];
    all.into_iter().flatten().map(|texture| (texture, image.is_cube))
}

fn is_same((one, is_cube): PlacedTexture, (other, other_is_cube): PlacedTexture) -> bool {
    Arc::ptr_eq(one, other) && is_cube == other_is_cube
}

/// Returns the levels of a texture without the largest ones; the last one always stays.
fn kept(texture: &Texture, left_out: usize) -> &[TextureLevel] {
    let levels = &texture.levels;
    &levels[left_out.min(levels.len() - 1)..]
}

/// Returns the gradient of each triangle's three image coordinates in its mesh's frame, with their value
/// at the first corner.
fn coordinates(prepared: &Prepared) -> Vec<[u32; COORDINATE_NUMBERS]> {
    if prepared.images.iter().all(Option::is_none) {
        return Vec::new();
    }
    let mut found = Vec::with_capacity(prepared.patch_of.len());
    for (number, part) in prepared.scenery.parts.iter().enumerate() {
        let of_part = prepared.images[number].as_ref().and_then(|image| image.from_mesh);
        for (corners, patch) in part.mesh.triangles.iter().zip(prepared.patches_of(number)) {
            let uv = prepared.patches[*patch as usize].uv;
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
