//! Light of materials beyond their colour.

use std::collections::BTreeMap;

use crate::SimError;
use crate::mjcf::text::source::MjcfText;
use crate::mjcf::text::stated::Classes;

/// Emission and reflection of a material, in the meaning of MuJoCo's renderer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Light that the surface emits, as a multiple of its colour.
    pub emission_factor: f32,
    /// Strength of highlights.
    pub specular_factor: f32,
    /// Sharpness of highlights: their exponent is 128 times it.
    pub shininess_factor: f32,
}

/// Gloss of materials, by their names, where it is not the default.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mjcf) struct Glosses(BTreeMap<String, Gloss>);

impl Default for Gloss {
    fn default() -> Gloss {
        Gloss { emission_factor: 0.0, specular_factor: 0.5, shininess_factor: 0.5 }
    }
}

impl Glosses {
    pub fn of(source: &MjcfText) -> Result<Glosses, SimError> {
        let xml = source.xml()?;
        let classes = Classes::of(&xml);
        let mut found = BTreeMap::new();
        for node in xml.descendants().filter(|node| node.has_tag_name("material")) {
            let Some(name) = node.attribute("name") else { continue };
            let usual = Gloss::default();
            let stated = |attribute: &str, usual: f32| {
                let number = classes.stated(&node, attribute).and_then(|text| text.trim().parse().ok());
                number.unwrap_or(usual)
            };
            let gloss = Gloss {
                emission_factor: stated("emission", usual.emission_factor),
                specular_factor: stated("specular", usual.specular_factor),
                shininess_factor: stated("shininess", usual.shininess_factor),
            };
            if gloss != usual {
                found.insert(name.into(), gloss);
            }
        }
        Ok(Glosses(found))
    }

    /// Returns the gloss of a geom with a material, or without one.
    pub fn find(&self, material: Option<&str>) -> Gloss {
        material.and_then(|name| self.0.get(name)).copied().unwrap_or_default()
    }
}
