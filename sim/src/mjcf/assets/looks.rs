//! Conventions for appearance: patterns of materials, and the groups of geoms that are drawn.

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::Node;

use crate::SimError;
use crate::mjcf::text::source::MjcfText;
use crate::mjcf::text::stated::Classes;

/// Pattern that a file gives to one of its materials.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SurfacePattern {
    Wood,
    Fabric,
    Print,
    /// Squares of half a metre in the world's ground plane, in the two colours of a builtin checker.
    Tiles,
}

/// Appearance settings for which MJCF has no attributes.
#[derive(Clone, Debug, Default, PartialEq)]
pub(in crate::mjcf) struct Looks {
    /// Patterns by the name of the material.
    pub patterns: BTreeMap<String, SurfacePattern>,
    /// Groups that are drawn; `None` for MuJoCo's default.
    pub drawn_groups: Option<BTreeSet<i32>>,
}

/// Name of the `<text>` with patterns: names of materials, each followed by its pattern.
const PATTERNS: &str = "material_patterns";
/// Name of the `<numeric>` with the groups that are drawn.
const DRAWN_GROUPS: &str = "drawn_groups";
/// Last group that is drawn by default. As in MuJoCo, groups 3 and above are hidden; robots have their
/// collision shapes there.
const LAST_DRAWN_GROUP: i32 = 2;

impl Looks {
    pub fn of(source: &MjcfText) -> Result<Looks, SimError> {
        let xml = source.xml()?;
        let named = |tag: &str, name: &str| {
            let mut found = xml.descendants().filter(|node| node.has_tag_name(tag));
            found.find(|node| node.attribute("name") == Some(name))
        };
        let patterns = match named("text", PATTERNS) {
            Some(text) => patterns(source, &text)?,
            None => BTreeMap::new(),
        };
        let groups = |node: Node| {
            let words = node.attribute("data").unwrap_or_default().split_ascii_whitespace();
            words.filter_map(|word| word.parse::<f64>().ok()).map(|group| group as i32).collect()
        };
        let chosen = named("numeric", DRAWN_GROUPS).map(groups);
        let drawn_groups = chosen.or_else(|| draws_group_1(&xml).then(|| BTreeSet::from([1, 2])));
        Ok(Looks { patterns, drawn_groups })
    }

    pub fn is_drawn(&self, group: i32) -> bool {
        match &self.drawn_groups {
            Some(groups) => groups.contains(&group),
            None => group <= LAST_DRAWN_GROUP,
        }
    }
}

/// Returns true if a file follows the convention of robosuite and RoboCasa: geoms with mass and collisions
/// are in group 0, visible ones in group 1.
fn draws_group_1(xml: &roxmltree::Document) -> bool {
    let weighs_by_0 = xml.descendants().any(|node| {
        let range = node.attribute("inertiagrouprange").filter(|_| node.has_tag_name("compiler"));
        range.is_some_and(|range| range.split_ascii_whitespace().eq(["0", "0"]))
    });
    let classes = Classes::of(xml);
    let in_tree = |node: &Node| node.ancestors().any(|one| one.has_tag_name("worldbody"));
    let mut geoms = xml.descendants().filter(|node| node.has_tag_name("geom")).filter(in_tree);
    weighs_by_0
        && geoms.any(|geom| {
            let says = |attribute: &str, word: &str| classes.stated(&geom, attribute) == Some(word);
            says("group", "1") && says("contype", "0") && says("conaffinity", "0")
        })
}

fn patterns(source: &MjcfText, text: &Node) -> Result<BTreeMap<String, SurfacePattern>, SimError> {
    let words: Vec<&str> = text.attribute("data").unwrap_or_default().split_ascii_whitespace().collect();
    let mut found = BTreeMap::new();
    for pair in words.chunks(2) {
        let pattern = match pair {
            [_, "wood"] => SurfacePattern::Wood,
            [_, "fabric"] => SurfacePattern::Fabric,
            [_, "print"] => SurfacePattern::Print,
            [_, "tiles"] => SurfacePattern::Tiles,
            _ => {
                let what = format!(
                    "`{}`; use a material and its pattern: wood, fabric, print or tiles",
                    pair.join(" ")
                );
                return Err(source.refuse(text, what));
            }
        };
        found.insert(pair[0].to_string(), pattern);
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mjcf::{Document, Geom};

    fn geoms(inside: &str) -> Result<Vec<Geom>, SimError> {
        let document = Document::parse("room.xml", &format!("<mujoco>{inside}</mujoco>"))?;
        Ok(document.trees()?.remove(0).links.remove(0).geoms)
    }

    #[test]
    fn a_material_has_a_pattern_where_the_file_says_so_and_not_by_its_name() {
        let asset = r#"<asset><material name="oak"/><material name="print_tex"/></asset>"#;
        let shapes =
            r#"<worldbody><geom size="1" material="oak"/><geom size="1" material="print_tex"/></worldbody>"#;
        let found = |custom: &str| {
            let geoms = geoms(&format!("{custom}{asset}{shapes}"))?;
            Ok::<_, SimError>(geoms.iter().map(|geom| geom.pattern).collect::<Vec<_>>())
        };
        assert_eq!(found("").expect("a room"), [None, None]);
        let text = |data: &str| format!(r#"<custom><text name="material_patterns" data="{data}"/></custom>"#);
        assert_eq!(found(&text("oak wood")).expect("a room"), [Some(SurfacePattern::Wood), None]);
        let error = found(&text("oak wood print_tex")).expect_err("half a pair").to_string();
        assert!(error.contains("`print_tex`; use a material and its pattern"), "{error}");
    }

    /// MuJoCo fills the bottom of a flat cube with the second colour. A cube is the default type.
    #[test]
    fn a_flat_texture_colours_its_material() {
        let rgba = |texture: &str, material: &str| {
            let room = format!(
                r#"<asset><texture name="paint" {texture}/><material name="wall" texture="paint"
                {material}/></asset><worldbody><geom size="1" material="wall"/></worldbody>"#
            );
            geoms(&room).expect("a room")[0].rgba
        };
        let flat = r#"builtin="flat" rgb1="1 0.5 0" rgb2="0.4 0.5 0.6" width="8" height="8""#;
        let plain = format!(r#"type="2d" {flat}"#);
        // Textures have bytes.
        let check = |found: [f32; 4], expected: [f32; 4]| {
            let is_near =
                found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 0.004);
            assert!(is_near, "{found:?} instead of {expected:?}");
        };
        check(rgba(&plain, ""), [1.0, 0.5, 0.0, 1.0]);
        check(rgba(&plain, r#"rgba="0.5 0.5 0.5 0.8""#), [0.5, 0.25, 0.0, 0.8]);
        for cube in [format!(r#"type="cube" {flat}"#), flat.to_string()] {
            check(rgba(&cube, ""), [0.9, 0.5, 0.1, 1.0]);
        }
        check(rgba(r#"type="2d" builtin="flat" width="8" height="8""#, ""), [0.8, 0.8, 0.8, 1.0]);
    }

    #[test]
    fn what_is_clear_or_in_a_hidden_group_is_not_drawn() {
        let drawn =
            |inside: &str| geoms(inside).expect("a room").iter().map(|geom| geom.drawn).collect::<Vec<_>>();
        let alphas = r#"<worldbody><geom size="1" rgba="1 0 0 0"/><geom size="1" rgba="1 0 0 0.5"/>
            <geom size="1" rgba="1 0 0 0.6"/><geom size="1" group="3"/></worldbody>"#;
        assert_eq!(drawn(alphas), [false, true, true, false]);
        let groups = r#"<worldbody><geom size="1"/><geom size="1" group="1" contype="0" conaffinity="0"/>
            <geom size="1" group="3"/></worldbody>"#;
        assert_eq!(drawn(groups), [true, true, false]);
        let robosuite = format!(r#"<compiler inertiagrouprange="0 0"/>{groups}"#);
        assert_eq!(drawn(&robosuite), [false, true, false]);
        let chosen = format!(r#"<custom><numeric name="drawn_groups" data="0 3"/></custom>{groups}"#);
        assert_eq!(drawn(&chosen), [true, false, true]);
    }
}
