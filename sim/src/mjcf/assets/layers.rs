//! Layers of materials: textures with roles, combined into one image each for colour, gloss, relief and
//! emitted light.

use std::collections::BTreeMap;
use std::sync::Arc;

use roxmltree::Node;

use super::texture::{TexelMeaning, Texture};
use crate::SimError;
use crate::mjcf::Document;

/// Roles of textures that determine the mapping of a material's images. The first role that the material has
/// counts.
const PLACING: [&str; 9] =
    ["rgb", "rgba", "orm", "roughness", "metallic", "normal", "opacity", "emissive", "occlusion"];

/// Images of the materials that have layers, by the names of the materials.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mjcf) struct Layers(BTreeMap<String, MaterialLayers>);

/// Images of a material with layers.
#[derive(Clone, Debug, PartialEq)]
pub(in crate::mjcf) struct MaterialLayers {
    /// Names of the textures, by role.
    named: BTreeMap<String, String>,
    /// Colour, white without a colour layer, and opacity.
    colour: Arc<Texture>,
    /// Share of ambient light in the first channel, roughness in the second, metallic share in the third.
    pub gloss: Option<Arc<Texture>>,
    /// Normals in the frame of the surface, each 0 to 1 for -1 to 1.
    pub relief: Option<Arc<Texture>>,
    /// Emitted light.
    pub emitted: Option<Arc<Texture>>,
}

impl MaterialLayers {
    /// Returns the name of the texture that determines the mapping of the images.
    pub fn placing(&self) -> Option<&str> {
        PLACING.iter().find_map(|role| self.named.get(*role)).map(String::as_str)
    }
}

impl Layers {
    pub fn find(&self, material: &mjcf_rs::assets::Material) -> Option<&MaterialLayers> {
        self.0.get(material.name.as_ref()?)
    }

    /// Returns the names of all textures, by material and role.
    pub fn names(&self) -> Vec<(&String, &BTreeMap<String, String>)> {
        self.0.iter().map(|(material, layers)| (material, &layers.named)).collect()
    }
}

impl Document {
    /// Combines the layers into images, and notes layers that are not drawn.
    pub(in crate::mjcf) fn read_layers(&mut self) -> Result<(), SimError> {
        let (mut found, mut notes) = (BTreeMap::new(), Vec::new());
        let xml = self.source.xml()?;
        for material in xml.descendants().filter(|node| node.has_tag_name("material")) {
            let layers = || material.children().filter(|child| child.has_tag_name("layer"));
            let role =
                |layer: &Node| Some((layer.attribute("role")?.into(), layer.attribute("texture")?.into()));
            let named: BTreeMap<String, String> = layers().filter_map(|layer| role(&layer)).collect();
            for layer in layers() {
                notes.extend(self.note_on_layer(&layer));
            }
            if let (Some(name), false) = (material.attribute("name"), named.is_empty()) {
                found.insert(name.into(), self.of_layers(named));
            }
        }
        drop(xml);
        self.layers = Layers(found);
        self.checked.approximated.extend(notes);
        Ok(())
    }

    /// Returns the note on a layer that is not drawn.
    fn note_on_layer(&self, layer: &Node) -> Option<String> {
        let role = layer.attribute("role").filter(|role| !matches!(*role, "rgb" | "rgba"))?;
        let has_faces = |name: &str| self.texture(name).is_some_and(|texture| texture.images() > 1);
        layer.attribute("texture").is_some_and(has_faces).then(|| {
            let line = self.source.line(layer.range().start);
            format!("`{line}`: <layer role=\"{role}\"> is not drawn; it has an image for each face")
        })
    }

    fn of_layers(&self, named: BTreeMap<String, String>) -> MaterialLayers {
        let texture =
            |role: &str| self.texture(named.get(role)?).filter(|texture| !texture.levels.is_empty());
        let flat = |role: &str| texture(role).filter(|texture| texture.images() == 1);
        let channel = |role: &str, number: usize| flat(role).map(|texture| (&**texture, number));
        let roughness = channel("roughness", 0).or(channel("orm", 1));
        let metallic = channel("metallic", 0).or(channel("orm", 2));
        let occlusion = channel("occlusion", 0).or(channel("orm", 0));
        let is_glossy = occlusion.is_some() || roughness.is_some() || metallic.is_some();
        let gloss = is_glossy.then(|| {
            Texture::of_channels([occlusion, roughness, metallic, None], TexelMeaning::Numbers, [1.0; 3])
        });
        let normal = |number: usize| channel("normal", number);
        let relief = flat("normal").map(|_| {
            Texture::of_channels([normal(0), normal(1), normal(2), None], TexelMeaning::Numbers, [1.0; 3])
        });
        let white = Arc::new(Texture::plain([u8::MAX; 3]));
        let colour = texture("rgb").or(texture("rgba")).unwrap_or(&white).clone();
        let colour = match flat("opacity") {
            Some(opacity) if colour.images() == 1 => {
                let rgb = |number: usize| Some((&*colour, number));
                let channels = [rgb(0), rgb(1), rgb(2), Some((&**opacity, 0))];
                Arc::new(Texture::of_channels(channels, TexelMeaning::Light, colour.mean_rgb))
            }
            _ => colour,
        };
        let emitted = flat("emissive").cloned();
        MaterialLayers { named, colour, gloss: gloss.map(Arc::new), relief: relief.map(Arc::new), emitted }
    }

    /// Returns the image of a material's colour.
    pub(in crate::mjcf) fn colour_of(&self, material: &mjcf_rs::assets::Material) -> Option<&Arc<Texture>> {
        match self.layers.find(material) {
            Some(layers) => Some(&layers.colour),
            None => self.texture(material.texture.as_ref()?),
        }
    }
}
