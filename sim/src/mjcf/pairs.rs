//! Pairs of geoms that touch whatever their masks say.

use super::text::settings::FileSettings;
use super::text::source::MjcfText;
use super::text::stated::Classes;
use crate::SimError;
use crate::dynamics::{Directions, Friction};

/// A `<pair>` of a file. What it does not state comes from the two geoms.
#[derive(Clone, Debug, PartialEq)]
pub struct GeomPair {
    pub geoms: [String; 2],
    directions: Option<Directions>,
    /// Coefficients of sliding, spin and roll; MuJoCo has two for sliding and two for rolling, of which the
    /// first counts here.
    friction: Option<[f64; 3]>,
}

impl GeomPair {
    /// Reads the pairs of a file; none if the file disables contacts.
    pub(super) fn all(source: &MjcfText, settings: &FileSettings) -> Result<Vec<GeomPair>, SimError> {
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
        Ok(GeomPair {
            geoms: [geom("geom1")?, geom("geom2")?],
            directions: condim.and_then(Directions::from_condim),
            // MuJoCo fills up with its own numbers.
            friction: numbers("friction").map(|stated| {
                let at = |index: usize, usual: f64| stated.get(index).copied().unwrap_or(usual);
                [at(0, 1.0), at(2, 0.005), at(3, 0.0001)]
            }),
        })
    }

    /// Returns true if the geom of this name is one of the two.
    pub(super) fn has(&self, geom: &str) -> bool {
        self.geoms.iter().any(|name| name == geom)
    }

    /// Returns the friction between the two geoms, which have these by themselves.
    pub fn friction(&self, a: &Friction, b: &Friction) -> Friction {
        let by_themselves = Friction::as_made(a, b);
        let own = [by_themselves.slide, by_themselves.spin_m, by_themselves.roll_m];
        let [slide, spin_m, roll_m] = self.friction.unwrap_or(own);
        let directions = self.directions.unwrap_or(by_themselves.directions);
        Friction { directions, slide, spin_m, roll_m, ..by_themselves }
    }
}
