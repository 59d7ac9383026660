//! Check of a file, element by element, against the table in [`support`].

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Attribute as XmlAttribute, Node};

use super::source::{self, MjcfText};
use crate::SimError;
use crate::mjcf::support::{self, Element, Support, Takes, value};

/// Maximum nesting of elements: the parser recurses.
const MAX_NESTING: usize = 200;
/// Attributes that give a rotation; an element has at most one.
const ROTATIONS: [&str; 6] = ["quat", "axisangle", "euler", "xyaxes", "zaxis", "fullinertia"];

/// Findings about a file whose elements were all accepted.
#[derive(Clone, Debug, Default)]
pub(in crate::mjcf) struct Checked {
    /// Elements that differ slightly from MuJoCo, each with the first line that contains it.
    pub approximated: Vec<String>,
    /// Bodies in the order of `mjcf-rs`: the world first, and every body before the bodies it carries.
    pub bodies: Vec<BodyBytes>,
}

/// Positions in the text of a body and of the elements inside.
#[derive(Clone, Debug, Default)]
pub(in crate::mjcf) struct BodyBytes {
    pub body: usize,
    pub joints: Vec<usize>,
    pub geoms: Vec<usize>,
}

/// Checks a file. Refused elements with a name in `left_out` are only noted.
pub(in crate::mjcf) fn check(source: &MjcfText, left_out: &[&str]) -> Result<Checked, SimError> {
    let xml = source.xml()?;
    check_depth(source, &xml)?;
    let root = xml.root_element();
    if !root.has_tag_name("mujoco") {
        let name = root.tag_name().name();
        let what =
            format!("an MJCF file is a <mujoco>, not a <{name}>; `tandem import` converts SDF and URDF");
        return Err(source.refuse(&root, what));
    }
    let mut check = Check {
        source,
        names: BTreeMap::new(),
        classes: BTreeSet::from(["main".into()]),
        left_out,
        approximated: BTreeSet::new(),
        refused: Vec::new(),
        found: Checked { bodies: vec![BodyBytes::default()], ..Checked::default() },
    };
    check.collect_names(&root);
    for default in root.children().filter(|node| node.has_tag_name("default")) {
        check.collect_class(&default, None);
    }
    check.check_angles(&root);
    if let Some(mujoco) = support::element("", "mujoco") {
        check.attributes(&root, mujoco);
    }
    check.children(&root, 0);
    match SimError::of_all(check.refused) {
        None => Ok(check.found),
        Some(error) => Err(error),
    }
}

fn is_default(node: &Node) -> bool {
    node.has_tag_name("default")
}

/// Refuses elements that are nested too deeply.
pub(super) fn check_depth(source: &MjcfText, xml: &roxmltree::Document) -> Result<(), SimError> {
    let mut depths = vec![0; xml.descendants().count()];
    for node in xml.descendants().filter(Node::is_element) {
        let depth = node.parent_element().map_or(0, |parent| depths[parent.id().get_usize()] + 1);
        depths[node.id().get_usize()] = depth;
        if depth > MAX_NESTING {
            let what = format!("more than {MAX_NESTING} elements inside one another; nest fewer");
            return Err(source.refuse(&node, what));
        }
    }
    Ok(())
}

struct Check<'a> {
    source: &'a MjcfText,
    /// The names in use, by kind of element.
    names: BTreeMap<&'static str, BTreeSet<String>>,
    classes: BTreeSet<String>,
    left_out: &'a [&'a str],
    /// Elements and attributes that have been reported.
    approximated: BTreeSet<(String, String)>,
    /// Reasons for which the file is refused.
    refused: Vec<SimError>,
    found: Checked,
}

impl Check<'_> {
    fn refuse(&mut self, node: &Node, what: impl AsRef<str>) {
        self.refused.push(self.source.refuse(node, what));
    }

    /// Refuses settings after a class with angles. Here the angles of a class are read with the settings
    /// before it. In MuJoCo all settings are read first.
    fn check_angles(&mut self, root: &Node) {
        let has_angles = |node: Node| node.has_attribute("euler") || node.has_attribute("axisangle");
        let mut sections =
            root.children().skip_while(|one| !one.descendants().any(has_angles) || !is_default(one));
        if let Some(compiler) = sections.find(|one| one.has_tag_name("compiler")) {
            self.refuse(&compiler, "a <default> before it has angles; put it first");
        }
    }

    /// Collects names, which must be unique among elements of a kind.
    fn collect_names(&mut self, root: &Node) {
        for node in root.descendants().filter(Node::is_element) {
            let within = node.parent_element().map_or("", |parent| parent.tag_name().name());
            let kind = support::element(within, node.tag_name().name()).and_then(|element| element.kind);
            let (Some(kind), false) = (kind, within == "default") else { continue };
            let file_stem = || std::path::Path::new(node.attribute("file")?).file_stem()?.to_str();
            let Some(name) = node.attribute("name").or_else(file_stem).filter(|name| !name.is_empty()) else {
                continue;
            };
            if !self.names.entry(kind).or_default().insert(name.into()) || (kind, name) == ("body", "world") {
                self.refuse(&node, format!("there is a {kind} `{name}` already; name it otherwise"));
            }
        }
    }

    fn collect_class(&mut self, node: &Node, parent: Option<&str>) {
        let name = match (node.attribute("class"), parent) {
            (Some("main") | None, None) => "main",
            (Some(name), Some(_)) if !self.classes.contains(name) => name,
            (Some(_), None) => {
                return self.refuse(node, "the outermost class is called main; put this into it");
            }
            (Some(_), Some(_)) => return self.refuse(node, "there is a class of this name already"),
            (None, Some(_)) => return self.refuse(node, "a class inside another needs a name"),
        };
        self.classes.insert(name.into());
        for child in node.children().filter(is_default) {
            self.collect_class(&child, Some(name));
        }
    }

    /// Checks the content of an element. `body` is the body that contains it.
    fn children(&mut self, node: &Node, body: usize) {
        let within = node.tag_name().name();
        for child in node.children().filter(Node::is_element) {
            let name = child.tag_name().name();
            let Some(element) = support::element(within, name) else {
                let have = support::names_within(within).join(", ");
                self.refuse(&child, format!("no element that is read; in a <{within}> may stand: {have}"));
                continue;
            };
            match element.support {
                Support::Ignored => {}
                Support::Refused if self.left_out.contains(&name) => {
                    self.approximate(&child, name, "", "it is left out");
                }
                Support::Refused => self.refuse(&child, format!("<{name}> is not read; {}", element.note)),
                // The approximation does not depend on the content.
                Support::Approximated => self.approximate(&child, name, "", element.note),
                Support::Mapped => {
                    self.attributes(&child, element);
                    let body = self.locate(&child, body);
                    self.children(&child, body);
                }
            }
        }
    }

    /// Records the positions of bodies, joints and geoms. Returns the body that contains the element's
    /// own content.
    fn locate(&mut self, node: &Node, body: usize) -> usize {
        let byte = node.range().start;
        let in_tree = node.ancestors().any(|one| one.has_tag_name("worldbody"));
        match node.tag_name().name() {
            "worldbody" => 0,
            "body" => {
                self.found.bodies.push(BodyBytes { body: byte, ..BodyBytes::default() });
                self.found.bodies.len() - 1
            }
            "joint" | "freejoint" if in_tree => {
                self.found.bodies[body].joints.push(byte);
                body
            }
            "geom" if in_tree => {
                self.found.bodies[body].geoms.push(byte);
                body
            }
            _ => body,
        }
    }

    fn attributes(&mut self, node: &Node, element: &Element) {
        let name = element.name;
        for attribute in node.attributes() {
            let known = element.attribute(attribute.name());
            let Some(known) = known else {
                self.refuse(node, format!("<{name}> has no attribute `{}` that is read", attribute.name()));
                continue;
            };
            let usual =
                matches!(known.takes, Takes::Only(values) if value::is_one_of(attribute.value(), values));
            match known.support {
                Support::Ignored => {}
                Support::Refused if !usual => {
                    self.refuse(node, format!("{} is not read; {}", stated(&attribute), known.note));
                }
                Support::Approximated if !usual => self.approximate(node, name, attribute.name(), known.note),
                Support::Refused | Support::Approximated => {}
                Support::Mapped => self.value(node, &attribute, known.takes),
            }
        }
        let rotations = node.attributes().filter(|attribute| ROTATIONS.contains(&attribute.name())).count();
        if rotations > 1 {
            self.refuse(node, "state one rotation");
        }
    }

    fn value(&mut self, node: &Node, attribute: &XmlAttribute, takes: Takes) {
        let known = |name: &str| match takes {
            Takes::Class => self.classes.contains(name),
            Takes::NameOf(kind) => self.names.get(kind).is_some_and(|names| names.contains(name)),
            Takes::Text
            | Takes::Numbers { .. }
            | Takes::Direction(_)
            | Takes::Quaternion
            | Takes::Axes
            | Takes::AxisSequence
            | Takes::Word(_)
            | Takes::Only(_) => true,
        };
        let wanted = match takes {
            Takes::Class if !known(attribute.value()) => Some("the class of a <default>".to_string()),
            // In an unused class, the name in an attribute does not matter.
            Takes::NameOf(_) if node.parent_element().is_some_and(|parent| is_default(&parent)) => None,
            Takes::NameOf("mesh") => None,
            Takes::NameOf(kind) if !known(attribute.value()) => Some(format!("the name of a {kind}")),
            takes => value::wanted(attribute.value(), takes),
        };
        if let Some(wanted) = wanted {
            self.refuse(node, format!("{}; use {wanted}", stated(attribute)));
        }
    }

    fn approximate(&mut self, node: &Node, element: &str, attribute: &str, note: &str) {
        if self.approximated.insert((element.into(), attribute.into())) {
            let what = if attribute.is_empty() { String::new() } else { format!(" has {attribute}") };
            let line = self.source.line(node.range().start);
            self.found.approximated.push(format!("`{line}`: {}{what}: {note}", source::describe(node)));
        }
    }
}

fn stated(attribute: &XmlAttribute) -> String {
    let value: String = attribute.value().chars().take(80).collect();
    format!("{}=\"{value}\"", attribute.name())
}
