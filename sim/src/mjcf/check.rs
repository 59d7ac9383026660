//! Check of a file, element by element, against the table in [`support`].

use std::collections::{BTreeMap, BTreeSet};

use roxmltree::{Attribute as XmlAttribute, Node};

use super::source::{self, MjcfText};
use super::support::{self, Element, Support, Takes, value};
use crate::SimError;

/// Maximum nesting of elements: the parser recurses.
const MAX_NESTING: usize = 200;
/// Attributes that give a rotation; an element has at most one.
const ROTATIONS: [&str; 6] = ["quat", "axisangle", "euler", "xyaxes", "zaxis", "fullinertia"];

/// Findings about a file whose elements were all accepted.
#[derive(Debug, Default)]
pub(super) struct Checked {
    /// Elements that differ slightly from MuJoCo, each with the first line that has it.
    pub approximated: Vec<String>,
    /// Bodies in the order of `mjcf-rs`: the world, then every body before those on it.
    pub bodies: Vec<BodyBytes>,
}

/// Positions in the text of a body and of the elements on it.
#[derive(Debug, Default)]
pub(super) struct BodyBytes {
    pub body: usize,
    pub joints: Vec<usize>,
    pub geoms: Vec<usize>,
}

pub(super) fn check(source: &MjcfText) -> Result<Checked, SimError> {
    let xml = source.xml()?;
    check_depth(source, &xml)?;
    let root = xml.root_element();
    if !root.has_tag_name("mujoco") {
        let what = format!("an MJCF file is a <mujoco>, not a <{}>", root.tag_name().name());
        return Err(source.refuse(&root, what));
    }
    let mut check = Check {
        source,
        names: BTreeMap::new(),
        classes: BTreeMap::from([("main".into(), Class::default())]),
        approximated: BTreeSet::new(),
        found: Checked { bodies: vec![BodyBytes::default()], ..Checked::default() },
    };
    check.collect_names(&root)?;
    for default in root.children().filter(|node| node.has_tag_name("default")) {
        check.collect_class(&default, None)?;
    }
    check.check_shared_defaults(&root)?;
    check_angles(source, &root)?;
    if let Some(mujoco) = support::element("", "mujoco") {
        check.attributes(&root, mujoco, None)?;
    }
    check.children(&root, 0, None)?;
    Ok(check.found)
}

fn is_default(node: &Node) -> bool {
    node.has_tag_name("default")
}

fn check_depth(source: &MjcfText, xml: &roxmltree::Document) -> Result<(), SimError> {
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

/// Refuses settings after a class with angles: angles in a class are read with the settings before it,
/// and in MuJoCo all settings come first.
fn check_angles(source: &MjcfText, root: &Node) -> Result<(), SimError> {
    let has_angles = |node: Node| node.has_attribute("euler") || node.has_attribute("axisangle");
    let mut sections =
        root.children().skip_while(|one| !one.descendants().any(has_angles) || !is_default(one));
    match sections.find(|one| one.has_tag_name("compiler")) {
        Some(compiler) => Err(source.refuse(&compiler, "a <default> before it has angles; put it first")),
        None => Ok(()),
    }
}

/// A default class's own attributes.
#[derive(Default)]
struct Class {
    parent: Option<String>,
    /// Number of words of each attribute, by element and attribute.
    words: BTreeMap<(String, String), usize>,
}

struct Check<'a> {
    source: &'a MjcfText,
    /// The names in use, by kind of element.
    names: BTreeMap<&'static str, BTreeSet<String>>,
    classes: BTreeMap<String, Class>,
    /// Elements and attributes that have been reported.
    approximated: BTreeSet<(String, String)>,
    found: Checked,
}

impl Check<'_> {
    /// Collects names, which must be unique among elements of a kind.
    fn collect_names(&mut self, root: &Node) -> Result<(), SimError> {
        for node in root.descendants().filter(Node::is_element) {
            let within = node.parent_element().map_or("", |parent| parent.tag_name().name());
            let kind = support::element(within, node.tag_name().name()).and_then(|element| element.kind);
            let (Some(kind), false) = (kind, within == "default") else { continue };
            let file_stem = || std::path::Path::new(node.attribute("file")?).file_stem()?.to_str();
            let Some(name) = node.attribute("name").or_else(file_stem).filter(|name| !name.is_empty()) else {
                continue;
            };
            if !self.names.entry(kind).or_default().insert(name.into()) || (kind, name) == ("body", "world") {
                let what = format!("there is a {kind} `{name}` already; name it otherwise");
                return Err(self.source.refuse(&node, what));
            }
        }
        Ok(())
    }

    fn collect_class(&mut self, node: &Node, parent: Option<&str>) -> Result<(), SimError> {
        let name = match (node.attribute("class"), parent) {
            (Some("main") | None, None) => "main",
            (Some(_), None) => {
                return Err(self.source.refuse(node, "the outermost class is called main; put this into it"));
            }
            (Some(name), Some(_)) if !self.classes.contains_key(name) => name,
            (Some(_), Some(_)) => {
                return Err(self.source.refuse(node, "there is a class of this name already"));
            }
            (None, Some(_)) => return Err(self.source.refuse(node, "a class inside another needs a name")),
        };
        let class = self.classes.entry(name.into()).or_default();
        class.parent = parent.map(String::from);
        for child in node.children().filter(|child| child.is_element() && !is_default(child)) {
            for attribute in child.attributes() {
                let key = (child.tag_name().name().into(), attribute.name().into());
                class.words.insert(key, attribute.value().split_whitespace().count());
            }
        }
        for child in node.children().filter(is_default) {
            self.collect_class(&child, Some(name))?;
        }
        Ok(())
    }

    /// Refuses defaults that MuJoCo would share: there all actuators have one set of defaults, here each
    /// kind has its own.
    fn check_shared_defaults(&self, root: &Node) -> Result<(), SimError> {
        let of = |tag: &str, within: &str| {
            let within =
                |node: &Node| node.parent_element().is_some_and(|parent| parent.has_tag_name(within));
            root.descendants().find(|node| node.has_tag_name(tag) && within(node))
        };
        for (one, other) in [("motor", "position"), ("position", "motor")] {
            if let (Some(node), Some(_)) = (of(one, "default"), of(other, "actuator")) {
                let what = format!("it would count for every <{other}> too; state it on each actuator");
                return Err(self.source.refuse(&node, what));
            }
        }
        Ok(())
    }

    /// Checks the content of an element. `body` is the body that contains it, `class` the default class
    /// of its elements.
    fn children(&mut self, node: &Node, body: usize, class: Option<&str>) -> Result<(), SimError> {
        let within = node.tag_name().name();
        for child in node.children().filter(Node::is_element) {
            let name = child.tag_name().name();
            let Some(element) = support::element(within, name) else {
                let have = support::names_within(within).join(", ");
                let what = format!("no element that is read; in a <{within}> may stand: {have}");
                return Err(self.source.refuse(&child, what));
            };
            let note = element.note;
            match element.support {
                Support::Ignored => continue,
                Support::Refused => {
                    return Err(self.source.refuse(&child, format!("<{name}> is not read; {note}")));
                }
                Support::Approximated => self.approximate(&child, name, "", note),
                Support::Mapped => {}
            }
            self.attributes(&child, element, class)?;
            let body = self.locate(&child, body);
            self.children(&child, body, child.attribute("childclass").or(class))?;
        }
        Ok(())
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

    fn attributes(&mut self, node: &Node, element: &Element, class: Option<&str>) -> Result<(), SimError> {
        let name = element.name;
        for attribute in node.attributes() {
            let known = element.attribute(attribute.name());
            let Some(known) = known else {
                let what = format!("<{name}> has no attribute `{}` that is read", attribute.name());
                return Err(self.source.refuse(node, what));
            };
            let usual =
                matches!(known.takes, Takes::Only(values) if value::is_one_of(attribute.value(), values));
            match known.support {
                Support::Ignored => {}
                Support::Refused if !usual => {
                    let what = format!("{} is not read; {}", stated(&attribute), known.note);
                    return Err(self.source.refuse(node, what));
                }
                Support::Approximated if !usual => self.approximate(node, name, attribute.name(), known.note),
                Support::Refused | Support::Approximated => {}
                Support::Mapped => self.value(node, &attribute, known.takes)?,
            }
        }
        let rotations = node.attributes().filter(|attribute| ROTATIONS.contains(&attribute.name())).count();
        if rotations > 1 {
            return Err(self.source.refuse(node, "state one rotation"));
        }
        self.check_inherited(node, name, class)
    }

    fn value(&self, node: &Node, attribute: &XmlAttribute, takes: Takes) -> Result<(), SimError> {
        let known = |name: &str| match takes {
            Takes::Class => self.classes.contains_key(name),
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
            Takes::NameOf("mesh") => None,
            Takes::NameOf(kind) if !known(attribute.value()) => Some(format!("the name of a {kind}")),
            takes => value::wanted(attribute.value(), takes),
        };
        match wanted {
            None => Ok(()),
            Some(wanted) => Err(self.source.refuse(node, format!("{}; use {wanted}", stated(attribute)))),
        }
    }

    /// Checks that an element gives all parts of a value that MuJoCo would combine with its class's.
    fn check_inherited(&self, node: &Node, element: &str, class: Option<&str>) -> Result<(), SimError> {
        let class = match is_default(&node.parent_element().unwrap_or(*node)) {
            true => node.parent_element().and_then(|parent| self.parent_of(parent.attribute("class"))),
            false => Some(node.attribute("class").or(class).unwrap_or("main")),
        };
        let inherits = |attribute: &str| self.inherited(class, element, attribute);
        for attribute in node.attributes().filter(|one| ["size", "friction"].contains(&one.name())) {
            let count = attribute.value().split_whitespace().count();
            if inherits(attribute.name()).is_some_and(|inherited| inherited > count) {
                let what = format!("{} states fewer numbers than its class; state all", stated(&attribute));
                return Err(self.source.refuse(node, what));
            }
        }
        let rotation = |stated: &dyn Fn(&str) -> bool| ROTATIONS[..5].iter().any(|name| stated(name));
        let own = |name: &str| node.has_attribute(name);
        let of_class = |name: &str| inherits(name).is_some();
        let only_position = own("pos") && !rotation(&own) && rotation(&of_class);
        let only_rotation = !own("pos") && rotation(&own) && of_class("pos");
        if ["geom", "site"].contains(&element) && (only_position || only_rotation) {
            return Err(self.source.refuse(node, "its class states the other half of its pose; state both"));
        }
        Ok(())
    }

    fn parent_of(&self, class: Option<&str>) -> Option<&str> {
        self.classes.get(class.unwrap_or("main"))?.parent.as_deref()
    }

    /// Returns the number of words of an attribute in the nearest class that has it.
    fn inherited(&self, class: Option<&str>, element: &str, attribute: &str) -> Option<usize> {
        let key = (element.to_string(), attribute.to_string());
        let mut class = class;
        while let Some(name) = class {
            if let Some(words) = self.classes.get(name)?.words.get(&key) {
                return Some(*words);
            }
            class = self.parent_of(Some(name));
        }
        None
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
