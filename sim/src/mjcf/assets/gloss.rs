//! Light of materials beyond their colour.

use std::collections::BTreeMap;

use crate::SimError;
use crate::mjcf::text::source::MjcfText;
use crate::mjcf::text::stated::Classes;

/// Emission and reflection of a material, as MuJoCo's renderer defines them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss {
    /// Emitted light as a multiple of the surface's colour, or of its layer of emitted light.
    pub emission_factor: f32,
    /// Strength of highlights.
    pub specular_factor: f32,
    /// Sharpness of highlights; their exponent is 128 times this factor.
    pub shininess_factor: f32,
    /// Roughness, if the material gives it. Its square is the width of the facets' distribution (GGX).
    pub roughness_factor: Option<f32>,
    /// Share of the surface that reflects like metal, in the surface's colour.
    pub metallic_factor: f32,
    /// Share of ambient light that reaches the surface.
    pub ambient_factor: f32,
    /// Share of the mirror image in the colour of a plane, or of the upper side of a box.
    pub reflectance_factor: f32,
}

/// Gloss of materials, by their names, where it is not the default.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mjcf) struct Glosses(BTreeMap<String, Gloss>);

impl Default for Gloss {
    fn default() -> Gloss {
        Gloss {
            emission_factor: 0.0,
            specular_factor: 0.5,
            shininess_factor: USUAL_EXPONENT / SHININESS,
            roughness_factor: None,
            metallic_factor: 0.0,
            ambient_factor: 1.0,
            reflectance_factor: 0.0,
        }
    }
}

/// Minimum roughness; a smoother surface would be a mirror.
pub const MIN_ROUGHNESS: f32 = 0.05;
/// Factor from shininess to the exponent of highlights.
pub const SHININESS: f32 = 128.0;
/// Exponent of the highlights of materials without an exponent.
pub const USUAL_EXPONENT: f32 = 64.0;

impl Gloss {
    /// Returns the gloss with highlights for a roughness: an exponent for a distribution of the same width,
    /// and a strength that preserves their light. Source: Walter et al. 2007, section 5.2 (exponent of
    /// Phong's facets).
    #[inline(always)]
    pub fn as_rough_as(self, roughness_factor: f32) -> Gloss {
        let width = roughness_factor.clamp(MIN_ROUGHNESS, 1.0) * roughness_factor.clamp(MIN_ROUGHNESS, 1.0);
        let exponent = (2.0 / (width * width) - 2.0).min(SHININESS);
        Gloss {
            specular_factor: self.specular_factor * (exponent + 2.0) / (USUAL_EXPONENT + 2.0),
            shininess_factor: exponent / SHININESS,
            roughness_factor: Some(roughness_factor),
            ..self
        }
    }

    /// Returns the gloss at a texel of a layer, whose numbers are the share of ambient light, the roughness
    /// and the metallic share.
    #[inline(always)]
    pub fn at_texel(self, [ambient_factor, roughness_share, metallic_share]: [f32; 3]) -> Gloss {
        let here = Gloss { metallic_factor: self.metallic_factor * metallic_share, ambient_factor, ..self };
        match self.roughness_factor {
            Some(roughness_factor) => here.as_rough_as(roughness_factor * roughness_share),
            None => here,
        }
    }
}

impl Glosses {
    pub fn of(source: &MjcfText) -> Result<Glosses, SimError> {
        let xml = source.xml()?;
        let classes = Classes::of(&xml);
        let mut found = BTreeMap::new();
        for node in xml.descendants().filter(|node| node.has_tag_name("material")) {
            let Some(name) = node.attribute("name") else { continue };
            let stated = |attribute: &str| -> Option<f32> {
                classes.stated(&node, attribute).and_then(|text| text.trim().parse().ok())
            };
            // MuJoCo's default, -1, counts as not stated.
            let amount = |attribute: &str| stated(attribute).filter(|value| *value >= 0.0);
            let has_layer = |roles: &[&str]| {
                let mut layers = node.children().filter(|child| child.has_tag_name("layer"));
                layers.any(|layer| layer.attribute("role").is_some_and(|role| roles.contains(&role)))
            };
            let usual = Gloss::default();
            let (is_rough, is_metal) = (has_layer(&["roughness", "orm"]), has_layer(&["metallic", "orm"]));
            let has_numbers = is_rough || is_metal || has_layer(&["occlusion"]);
            let usual_emission_factor = if has_layer(&["emissive"]) { 1.0 } else { usual.emission_factor };
            let gloss = Gloss {
                emission_factor: stated("emission").unwrap_or(usual_emission_factor),
                specular_factor: stated("specular").unwrap_or(usual.specular_factor),
                shininess_factor: stated("shininess").unwrap_or(usual.shininess_factor),
                roughness_factor: amount("roughness").or(is_rough.then_some(1.0)),
                metallic_factor: amount("metallic").unwrap_or(if is_metal { 1.0 } else { 0.0 }).min(1.0),
                reflectance_factor: stated("reflectance").unwrap_or(usual.reflectance_factor).clamp(0.0, 1.0),
                ..usual
            };
            let gloss = match gloss.roughness_factor {
                // A layer determines the roughness point by point.
                Some(roughness) if !has_numbers && stated("shininess").is_none() => {
                    gloss.as_rough_as(roughness)
                }
                _ => gloss,
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
