//! Mapping of textures to surfaces. Source: MuJoCo's `render_gl3.c`, version 3.3.

use std::collections::BTreeMap;
use std::sync::Arc;

use rapier3d::math::Vector;
use roxmltree::Node;

use super::texture::Texture;
use crate::SimError;
use crate::mjcf::Document;
use crate::mjcf::text::source::MjcfText;
use crate::mjcf::text::stated::Classes;

/// Image on the surface of a geom.
#[derive(Clone, Debug, PartialEq)]
pub struct SurfaceImage {
    pub texture: Arc<Texture>,
    /// Numbers at the same places: share of ambient light in the first channel, roughness in the second,
    /// metallic share in the third.
    pub gloss: Option<Arc<Texture>>,
    /// Normals at the same places in the frame of the surface, each 0 to 1 for -1 to 1. The second axis
    /// points up in the image.
    pub relief: Option<Arc<Texture>>,
    /// Emitted light at the same places.
    pub emitted: Option<Arc<Texture>>,
    pub mapping: TextureMapping,
}

/// Mapping from points of a geom's surface, in the geom's frame, to an image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum TextureMapping {
    /// Mapping by the texture coordinates of the mesh's corners.
    Corners,
    /// Along z: `scale_1_m * (point - centre_m) - 0.5` in x and y are the coordinates to the right and down.
    /// The image repeats at every whole number.
    Along { scale_1_m: [f32; 2], centre_m: [f32; 2] },
    /// Onto a cube whose six faces show the image, in the direction `scale_1_m * (point - centre_m)`.
    Cube { scale_1_m: Vector, centre_m: Vector },
}

/// Size of a geom, for mappings that depend on it.
pub(in crate::mjcf) struct MappedShape {
    /// Half the size along each axis; 0 where a plane is unbounded.
    pub half_m: Vector,
    pub centre_m: Vector,
    pub is_mesh: bool,
    /// True if the mesh's corners have texture coordinates.
    pub has_uv: bool,
}

/// Repetitions of the images of materials, by the names of the materials whose texture has an image.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mjcf) struct TextureRepeats(BTreeMap<String, TextureRepeat>);

/// Attributes `texrepeat` and `texuniform` of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
struct TextureRepeat {
    repeats_factor: [f32; 2],
    /// True for repetitions per 2 m rather than per object.
    is_uniform: bool,
}

const ONCE: TextureRepeat = TextureRepeat { repeats_factor: [1.0; 2], is_uniform: false };

impl TextureRepeats {
    pub fn of(source: &MjcfText) -> Result<TextureRepeats, SimError> {
        let xml = source.xml()?;
        let classes = Classes::of(&xml);
        let named = |tag: &'static str| {
            let elements = xml.descendants().filter(move |node| node.has_tag_name(tag));
            elements.filter_map(|node| Some((node.attribute("name")?, node)))
        };
        let has_image = |node: &Node| {
            let attributes = node.attributes();
            attributes.into_iter().any(|one| one.name().starts_with("file") || one.name() == "builtin")
        };
        let drawn: BTreeMap<_, _> = named("texture").filter(|(_, node)| has_image(node)).collect();
        let mut found = BTreeMap::new();
        for (name, material) in named("material") {
            let texture = classes.stated(&material, "texture");
            let mut repeat = ONCE;
            let words = classes.stated(&material, "texrepeat").unwrap_or_default().split_ascii_whitespace();
            for (factor, word) in repeat.repeats_factor.iter_mut().zip(words) {
                *factor = word.parse().unwrap_or(1.0);
            }
            repeat.is_uniform = classes.stated(&material, "texuniform") == Some("true");
            let has_layers = material.children().any(|child| child.has_tag_name("layer"));
            if (has_layers || texture.is_some_and(|texture| drawn.contains_key(texture))) && repeat != ONCE {
                found.insert(name.into(), repeat);
            }
        }
        Ok(TextureRepeats(found))
    }
}

impl SurfaceImage {
    /// Returns the image of a material on a shape. Returns `None` if the material's texture has no image.
    pub(in crate::mjcf) fn of(
        document: &Document,
        material: &mjcf_rs::assets::Material,
        shape: impl FnOnce() -> MappedShape,
    ) -> Option<SurfaceImage> {
        let layers = document.layers.find(material);
        let gloss = layers.and_then(|layers| layers.gloss.clone());
        let relief = layers.and_then(|layers| layers.relief.clone());
        let emitted = layers.and_then(|layers| layers.emitted.clone());
        let has_layers = gloss.is_some() || relief.is_some() || emitted.is_some();
        // A single texel is a plain colour, which the geom already has.
        let is_image = |texture: &&Arc<Texture>| texture.levels[0].texels.len() > 1 || has_layers;
        let texture = document.colour_of(material).filter(is_image)?.clone();
        let name = layers.map_or(material.texture.as_deref(), |layers| layers.placing())?;
        let kind = document.model.assets.texture(name)?.type_.as_deref();
        let repeat = material.name.as_ref().and_then(|name| document.repeats.0.get(name));
        let repeat = repeat.copied().unwrap_or(ONCE);
        let shape = shape();
        let mapping = match kind {
            _ if shape.has_uv => TextureMapping::Corners,
            Some("2d") => along(repeat, &shape),
            _ => cube(repeat, &shape),
        };
        // Without coordinates in the surface, normals have no direction.
        let relief = relief.filter(|_| !matches!(mapping, TextureMapping::Cube { .. }));
        Some(SurfaceImage { texture, gloss, relief, emitted, mapping })
    }
}

fn along(TextureRepeat { repeats_factor, is_uniform }: TextureRepeat, shape: &MappedShape) -> TextureMapping {
    let MappedShape { half_m, centre_m, .. } = shape;
    let scale = |axis: usize| {
        let size_m = if is_uniform || half_m[axis] <= 0.0 { 1.0 } else { half_m[axis] };
        0.5 * repeats_factor[axis] / size_m
    };
    TextureMapping::Along { scale_1_m: [scale(0), -scale(1)], centre_m: [centre_m.x, centre_m.y] }
}

fn cube(TextureRepeat { is_uniform, .. }: TextureRepeat, shape: &MappedShape) -> TextureMapping {
    let MappedShape { half_m, centre_m, .. } = *shape;
    // MuJoCo scales a cube to its own shapes, and to meshes only if their textures are uniform.
    let scale_1_m = match (shape.is_mesh, is_uniform) {
        (false, false) => 1.0 / half_m.max(Vector::splat(f32::EPSILON)),
        (true, true) => half_m,
        (false, true) | (true, false) => Vector::ONE,
    };
    TextureMapping::Cube { scale_1_m, centre_m }
}
