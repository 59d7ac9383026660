//! A scenery with precomputed constant data for drawing.

use std::sync::Arc;

use rapier3d::math::{Pose, Vector};

use super::bend::Bend;
use super::patches::{MeshPatch, UvMap};
use super::shared::MeshGeometry;
use crate::render::shading::baked::BakedLight;
use crate::render::shading::image::Image;
use crate::render::shading::lanes::Affine;
use crate::render::shading::linear;
use crate::render::{Light, Part, Pattern, Scenery};

/// Limits on the factor that multiplies an image's texels. They keep nearly black images black.
const MIN_MEAN: f32 = 1e-6;
const MAX_TINT: f32 = 8.0;

/// Patch index of a sample without a surface.
pub const NOTHING: u32 = u32::MAX;

pub struct Prepared {
    pub scenery: Scenery,
    /// Baked light of the room, for rasterisers. `None` if a sun or the lights of a file light the scenery.
    pub baked: Option<Arc<BakedLight>>,
    pub patches: Vec<Patch>,
    /// The image of each part.
    pub images: Vec<Option<Image>>,
    /// True if layers of images change ambient light or emit light.
    pub has_layers: bool,
    /// Parts that show the surfaces behind them.
    pub is_veil: Vec<bool>,
    /// Image of the sky.
    pub sky: Option<Image>,
    /// Index of each triangle's patch, with triangles counted part by part.
    pub patch_of: Vec<u32>,
    /// Index of the first triangle of each part.
    first: Vec<usize>,
    /// Id of each patch in images.
    ids: Vec<u32>,
    /// Two colours of each part. The first multiplies the texels of an image.
    pub linear_rgb: Vec<[Vector; 2]>,
    /// Axis of each part's mesh along which the grain of its pattern runs.
    pub grain: Vec<usize>,
}

/// Patch: adjacent triangles of a part that share one shading formula.
#[derive(Clone, Copy)]
pub struct Patch {
    pub part: u32,
    pub bend: Bend,
    /// `None` without texture coordinates.
    pub uv: Option<UvMap>,
}

impl Prepared {
    /// Prepares a scenery without baked light.
    pub fn new(scenery: Scenery) -> Prepared {
        let (mut patches, mut patch_of, mut first) = (Vec::new(), Vec::new(), Vec::new());
        for (part, number) in scenery.parts.iter().zip(0..) {
            first.push(patch_of.len());
            let geometry = part.mesh.geometry();
            let first_patch = patches.len() as u32;
            patch_of.extend(geometry.patch_of.iter().map(|patch| first_patch + patch));
            let patch = |MeshPatch { bend, uv }: &MeshPatch| Patch { part: number, bend: *bend, uv: *uv };
            patches.extend(geometry.patches.iter().map(patch));
        }
        first.push(patch_of.len());
        let images: Vec<_> = scenery.parts.iter().map(|part| part.image.as_ref().map(Image::of)).collect();
        let id = |patch: &Patch| scenery.parts[patch.part as usize].id;
        Prepared {
            ids: patches.iter().map(id).collect(),
            baked: None,
            patches,
            has_layers: images.iter().flatten().any(Image::changes_light),
            images,
            is_veil: scenery.parts.iter().map(Part::is_veil).collect(),
            sky: scenery.sky.as_ref().map(Image::around),
            patch_of,
            first,
            linear_rgb: scenery.parts.iter().map(colours).collect(),
            grain: scenery.parts.iter().map(grain).collect(),
            scenery,
        }
    }

    /// Returns the factor on baked light. Returns `None` without baked light.
    pub fn tint(&self) -> Option<[f32; 3]> {
        let usual = Light::default().sun_rgb;
        self.baked.as_ref().map(|_| (self.scenery.light.sun_rgb / usual).to_array())
    }

    /// Returns the geometry of a part.
    #[inline(always)]
    pub fn geometry(&self, part: usize) -> &MeshGeometry {
        self.scenery.parts[part].mesh.geometry()
    }

    /// Returns the map from the world to the frame of a part's pattern, or to the coordinates of its image.
    pub fn pattern_from_world(&self, part: usize, world_from_mesh: Pose) -> Affine {
        match self.images[part].as_ref().and_then(|image| image.from_mesh) {
            Some(from_mesh) => from_mesh.after(world_from_mesh.inverse()),
            None => self.scenery.parts[part].pattern.frame(world_from_mesh, self.grain[part]),
        }
    }

    /// Returns the patch indices of a part's triangles.
    pub fn patches_of(&self, part: usize) -> &[u32] {
        &self.patch_of[self.first[part]..self.first[part + 1]]
    }

    /// Returns the id of a patch in images.
    #[inline(always)]
    pub fn id(&self, patch: u32) -> u32 {
        // No patch has the index [`NOTHING`].
        self.ids.get(patch as usize).copied().unwrap_or(0)
    }
}

/// Returns the axis of the grain: the longest one, or x for print, which stays upright.
fn grain(part: &Part) -> usize {
    if part.pattern == Pattern::Print { 0 } else { part.mesh.geometry().longest_axis }
}

/// Returns the two linear colours of a part.
fn colours(part: &Part) -> [Vector; 2] {
    let first = linear(part.rgb);
    if let Some(image) = &part.image {
        let tint = first / linear(image.texture.mean_rgb).max(Vector::splat(MIN_MEAN));
        return [tint.min(Vector::splat(MAX_TINT)); 2];
    }
    [first, part.pattern.second_rgb(first)]
}
