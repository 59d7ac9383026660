//! Pairs of geoms that touch regardless of their masks.

use crate::SimError;
use crate::dynamics::{Directions, Friction};
use crate::mjcf::text::settings::FileSettings;
use crate::mjcf::text::source::MjcfText;
use crate::mjcf::text::stated::Classes;

/// A `<pair>` of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct GeomPair {
    pub geoms: [String; 2],
    /// Friction between the two, which replaces their own.
    pub friction: Friction,
}

/// MuJoCo's friction of a pair: two tangents, the spin about the normal, and the roll about the tangents.
const FRICTION: [f64; 5] = [1.0, 1.0, 0.005, 0.0001, 0.0001];

impl GeomPair {
    /// Reads the pairs of a file; none if the file disables contacts.
    pub(in crate::mjcf) fn all(
        source: &MjcfText,
        settings: &FileSettings,
    ) -> Result<Vec<GeomPair>, SimError> {
        if !settings.touches {
            return Ok(Vec::new());
        }
        let xml = source.xml()?;
        let classes = Classes::of(&xml);
        let of_contact = |node: &roxmltree::Node| {
            node.has_tag_name("pair")
                && node.parent_element().is_some_and(|parent| parent.has_tag_name("contact"))
        };
        xml.descendants().filter(of_contact).map(|node| GeomPair::read(source, &classes, node)).collect()
    }

    fn read<'a, 'i: 'a>(
        source: &MjcfText,
        classes: &Classes<'a, 'i>,
        node: roxmltree::Node<'a, 'i>,
    ) -> Result<GeomPair, SimError> {
        let geom = |attribute: &str| {
            let name = node.attribute(attribute).map(String::from);
            name.ok_or_else(|| source.refuse(&node, format!("a pair needs a {attribute}")))
        };
        // The support table has accepted only numbers.
        let numbers = |attribute: &str| -> Option<Vec<f64>> {
            let words = classes.stated(&node, attribute)?.split_ascii_whitespace();
            Some(words.filter_map(|word| word.parse().ok()).collect())
        };
        let condim = classes.stated(&node, "condim").and_then(|word| word.parse().ok());
        let stated = numbers("friction").unwrap_or_default();
        let at = |index: usize| stated.get(index).copied().unwrap_or(FRICTION[index]);
        Ok(GeomPair {
            geoms: [geom("geom1")?, geom("geom2")?],
            // Friction here is the same along both tangents.
            friction: Friction {
                directions: condim.and_then(Directions::from_condim).unwrap_or(Directions::Slide),
                slide: at(0).max(at(1)),
                spin_m: at(2),
                roll_m: at(3).max(at(4)),
                priority: 0,
                left: 1.0,
            },
        })
    }

    /// Returns true if the geom of this name is one of the two.
    pub(in crate::mjcf) fn has(&self, geom: &str) -> bool {
        self.geoms.iter().any(|name| name == geom)
    }
}
