//! Copies of the content of `<replicate>`, written out like MuJoCo's. Each has its own frame, and its number
//! is appended to all names. Contacts, equalities and actuators that name something inside are copied, too.

#[cfg(test)]
mod tests;

use std::collections::{BTreeMap, BTreeSet};
use std::f64::consts::PI;
use std::ops::Range;

use rapier3d::glamx::{DQuat, DVec3};
use roxmltree::{Document, Node};

use super::check::check_depth;
use super::source::{MjcfText, inside};
use crate::SimError;
use crate::mjcf::support::{self, value};
use crate::user_file::MAX_TEXT_BYTES;

/// Maximum `count`.
const MAX_COPIES: usize = 100_000;
/// Sections whose elements are copied if they name a copied element.
const SECTIONS: [&str; 3] = ["contact", "equality", "actuator"];
/// Attributes of these elements that name others, by the kind of the named element.
const REFERENCES: [(&str, &[&str]); 4] = [
    ("body", &["body", "body1", "body2"]),
    ("joint", &["joint", "joint1", "joint2", "jointinparent"]),
    ("geom", &["geom1", "geom2"]),
    ("site", &["site", "site1", "site2", "refsite", "slidersite", "cranksite"]),
];

/// A `<replicate>`.
struct Replicate<'a, 'i> {
    node: Node<'a, 'i>,
    /// Opening tag of the frame of each copy.
    frames: Vec<String>,
    /// Suffix of the names in each copy.
    suffixes: Vec<String>,
}

/// An element of [`SECTIONS`] that is copied.
#[derive(Clone)]
struct CopiedElement {
    range: Range<usize>,
    names: Vec<CopiedName>,
}

/// End of an attribute that defines a copied name or refers to one.
#[derive(Clone)]
struct CopiedName {
    end: usize,
    /// Indices of the replicates around the element that it names, the outermost first.
    around: Vec<usize>,
    suffix: String,
}

/// Change at a range of the text.
enum TextChange {
    /// Suffixes of this number of replicates, counted from the outermost.
    Suffixes(usize),
    /// Copies of the content of a replicate.
    Copies(usize),
    Removal,
    /// Copies of the elements of a section.
    Elements(&'static str),
}

/// All content of a text that is copied.
struct CopyPlan<'a, 'i> {
    source: &'a MjcfText,
    root: Node<'a, 'i>,
    /// Ordered by the ends of their elements, so that an inner one is before the outer one.
    replicates: Vec<Replicate<'a, 'i>>,
    /// Indices of the replicates, by the numbers of their elements.
    numbers: BTreeMap<usize, usize>,
    /// Indices of the replicates around each named element, by its kind and name.
    around: BTreeMap<(&'static str, &'a str), Vec<usize>>,
    /// Copies by section.
    elements: BTreeMap<&'static str, Vec<CopiedElement>>,
    /// Numbers of elements that are replaced by copies.
    removed: BTreeSet<usize>,
}

/// Returns a text with the copies of every `<replicate>` written out.
pub(in crate::mjcf) fn written_out(source: MjcfText) -> Result<MjcfText, SimError> {
    if !source.text.contains("<replicate") {
        return Ok(source);
    }
    let xml = source.xml()?;
    check_depth(&source, &xml)?;
    let plan = CopyPlan::of(&source, &xml)?;
    let mut written = source.without_text();
    plan.write(plan.root, 0..source.text.len(), &[], &mut written)?;
    Ok(written)
}

impl<'a, 'i: 'a> Replicate<'a, 'i> {
    fn of(source: &MjcfText, node: Node<'a, 'i>, angles: &Angles) -> Result<Replicate<'a, 'i>, SimError> {
        let supported = support::element("body", "replicate");
        let refused = node.attributes().filter_map(|attribute| {
            let (name, stated) = (attribute.name(), attribute.value());
            let wanted = match supported.and_then(|element| element.attribute(name)) {
                Some(known) => format!("{name}=\"{stated}\"; use {}", value::wanted(stated, known.takes)?),
                None => format!("<replicate> has no attribute `{name}` that is read"),
            };
            Some(source.refuse(&node, wanted))
        });
        SimError::of_all(refused.collect()).map_or(Ok(()), Err)?;
        let count = node.attribute("count").and_then(|count| count.trim().parse::<usize>().ok());
        let Some(count) = count.filter(|count| *count <= MAX_COPIES) else {
            let what = format!("it needs a `count`, a whole number of at most {MAX_COPIES}");
            return Err(source.refuse(&node, what));
        };
        let numbers = |name: &str| -> [f64; 3] {
            let mut found = [0.0; 3];
            let words = node.attribute(name).unwrap_or_default().split_ascii_whitespace();
            found.iter_mut().zip(words).for_each(|(number, word)| *number = word.parse().unwrap_or(0.0));
            found
        };
        let (offset_m, euler) = (DVec3::from_array(numbers("offset")), numbers("euler"));
        let class = node.attribute("childclass").map(|class| format!(" childclass=\"{}\"", escaped(class)));
        let class = class.unwrap_or_default();
        let mut position_m = DVec3::ZERO;
        let frame = |number: usize| {
            let turn = angles.turn(euler.map(|angle| angle * number as f64));
            let (DVec3 { x, y, z }, [i, j, k, w]) = (position_m, turn.to_array());
            position_m += turn * offset_m;
            format!("<frame pos=\"{x} {y} {z}\" quat=\"{w} {i} {j} {k}\"{class}>")
        };
        let separator = escaped(node.attribute("sep").unwrap_or_default());
        let digits = count.to_string().len();
        Ok(Replicate {
            node,
            frames: (0..count).map(frame).collect(),
            suffixes: (0..count).map(|number| format!("{separator}{number:0digits$}")).collect(),
        })
    }
}

/// Meaning of Euler angles in a file.
struct Angles {
    rad_factor: f64,
    sequence: String,
}

impl Angles {
    fn of(xml: &Document) -> Angles {
        let stated = |name: &str| {
            let compilers = xml.descendants().filter(|node| node.has_tag_name("compiler"));
            compilers.filter_map(|node| node.attribute(name)).next_back()
        };
        Angles {
            rad_factor: if stated("angle") == Some("radian") { 1.0 } else { PI / 180.0 },
            sequence: stated("eulerseq").unwrap_or("xyz").into(),
        }
    }

    /// Returns the rotation by three angles. Small letters are axes that turn along, capital ones are fixed.
    fn turn(&self, euler_values: [f64; 3]) -> DQuat {
        self.sequence.chars().zip(euler_values).fold(DQuat::IDENTITY, |turn, (letter, angle)| {
            let axis = match letter.to_ascii_lowercase() {
                'x' => DVec3::X,
                'y' => DVec3::Y,
                _ => DVec3::Z,
            };
            let own = DQuat::from_axis_angle(axis, angle * self.rad_factor);
            if letter.is_ascii_lowercase() { turn * own } else { own * turn }
        })
    }
}

impl<'a, 'i: 'a> CopyPlan<'a, 'i> {
    fn of(source: &'a MjcfText, xml: &'a Document<'i>) -> Result<CopyPlan<'a, 'i>, SimError> {
        let in_tree = |node: &Node| node.ancestors().any(|one| one.has_tag_name("worldbody"));
        let mut nodes: Vec<Node> =
            xml.descendants().filter(|node| node.has_tag_name("replicate") && in_tree(node)).collect();
        nodes.sort_by_key(|node| node.range().end);
        let numbers: BTreeMap<usize, usize> = nodes.iter().map(number).zip(0..).collect();
        let angles = Angles::of(xml);
        let (mut replicates, mut refused) = (Vec::new(), Vec::new());
        for node in nodes {
            match Replicate::of(source, node, &angles) {
                Ok(replicate) => replicates.push(replicate),
                Err(error) => refused.push(error),
            }
        }
        SimError::of_all(refused).map_or(Ok(()), Err)?;
        let mut around: BTreeMap<(&str, &str), Vec<usize>> = BTreeMap::new();
        for node in xml.descendants().filter(|node| node.is_element() && in_tree(node)) {
            if let (Some(kind), Some(name)) = (kind(&node), node.attribute("name")) {
                let mut numbers: Vec<usize> =
                    node.ancestors().filter_map(|one| numbers.get(&number(&one)).copied()).collect();
                numbers.reverse();
                around.insert((kind, name), numbers);
            }
        }
        let (elements, removed) = (BTreeMap::new(), BTreeSet::new());
        let root = xml.root();
        let mut plan = CopyPlan { source, root, replicates, numbers, around, elements, removed };
        for section in SECTIONS {
            plan.copy_elements(section)?;
        }
        Ok(plan)
    }

    /// Returns the elements of a section.
    fn section(&self, tag: &'static str) -> impl Iterator<Item = Node<'a, 'i>> {
        let root = self.root.first_element_child();
        root.into_iter().flat_map(|root| root.children()).filter(move |node| node.has_tag_name(tag))
    }

    /// Copies the elements of a section that name an element of a replicate.
    fn copy_elements(&mut self, section: &'static str) -> Result<(), SimError> {
        let nodes = self.section(section).flat_map(|section| section.children()).filter(Node::is_element);
        let (mut found, mut removed) = (Vec::new(), Vec::new());
        for node in nodes {
            if let Some(element) = self.element(&node, section)? {
                removed.push(number(&node));
                found.push(element);
            }
        }
        for (number, replicate) in self.replicates.iter().enumerate() {
            found = self.copied(found, number, replicate)?;
        }
        self.removed.extend(removed);
        self.elements.insert(section, found);
        Ok(())
    }

    /// Returns a copied element of a section. Returns `None` if the element refers to nothing in a replicate.
    fn element(&self, node: &Node, section: &str) -> Result<Option<CopiedElement>, SimError> {
        let mut names = Vec::new();
        for (kind, attributes) in REFERENCES {
            for stated in attributes.iter().filter_map(|name| node.attribute_node(*name)) {
                let around = self.around.get(&(kind, stated.value())).cloned().unwrap_or_default();
                names.push(CopiedName { end: stated.range_value().end, around, suffix: String::new() });
            }
        }
        let Some(deepest) = names.iter().map(|name| name.around.clone()).max_by_key(Vec::len) else {
            return Ok(None);
        };
        if deepest.is_empty() {
            return Ok(None);
        }
        if names.iter().any(|name| !deepest.starts_with(&name.around)) {
            let what = "it names things in two <replicate>, of which each has its own copies; write it out";
            return Err(self.source.refuse(node, what));
        }
        if section == "equality" && names.iter().any(|name| name.around != deepest) {
            let what = "MuJoCo leaves out equalities between copies and other things; write the copies out";
            return Err(self.source.refuse(node, what));
        }
        if let Some(own) = node.attribute_node("name") {
            names.push(CopiedName { end: own.range_value().end, around: deepest, suffix: String::new() });
        }
        names.sort_by_key(|name| name.end);
        Ok(Some(CopiedElement { range: node.range(), names }))
    }

    /// Replaces elements that name an element of a replicate by their copies, behind all others.
    fn copied(
        &self,
        elements: Vec<CopiedElement>,
        number: usize,
        replicate: &Replicate,
    ) -> Result<Vec<CopiedElement>, SimError> {
        let is_inside =
            |element: &CopiedElement| element.names.iter().any(|name| name.around.contains(&number));
        let (inside, mut all): (Vec<_>, Vec<_>) = elements.into_iter().partition(is_inside);
        let bytes: usize = inside.iter().map(|element| element.range.len()).sum();
        self.check_size(&replicate.node, bytes.saturating_mul(replicate.suffixes.len()))?;
        for suffix in &replicate.suffixes {
            all.extend(inside.iter().cloned().map(|mut element| {
                let names = element.names.iter_mut().filter(|name| name.around.contains(&number));
                names.for_each(|name| name.suffix += suffix);
                element
            }));
        }
        Ok(all)
    }

    fn check_size(&self, node: &Node, bytes: usize) -> Result<(), SimError> {
        if bytes as u64 <= MAX_TEXT_BYTES {
            return Ok(());
        }
        let what = format!("its copies are more than {} MB of text; make fewer", MAX_TEXT_BYTES >> 20);
        Err(self.source.refuse(node, what))
    }

    /// Returns the changes inside of an element that has `depth` replicates around its content.
    fn changes(&self, node: Node, depth: usize) -> Vec<(Range<usize>, TextChange)> {
        let (mut changes, mut written) = (Vec::new(), 0);
        for one in node.descendants().filter(|one| one.is_element() && *one != node) {
            let range = one.range();
            if range.start < written {
                continue;
            }
            if let Some(number) = self.numbers.get(&number(&one)) {
                written = range.end;
                changes.push((range, TextChange::Copies(*number)));
            } else if self.removed.contains(&number(&one)) {
                written = range.end;
                changes.push((range, TextChange::Removal));
            } else {
                let end = |name: &str| one.attribute_node(name).map(|stated| stated.range_value().end);
                let target = one.attribute("target").and_then(|target| self.around.get(&("body", target)));
                let names = [(end("name"), depth), (end("target"), target.map_or(0, Vec::len).min(depth))];
                let ends = names.into_iter().filter(|(_, depth)| *depth > 0);
                changes
                    .extend(ends.filter_map(|(end, depth)| Some((end?..end?, TextChange::Suffixes(depth)))));
            }
        }
        if depth == 0 {
            let end = |section: &'static str| {
                let end = self.section(section).filter_map(|section| inside(&section)).last()?.end;
                Some((end..end, TextChange::Elements(section)))
            };
            changes.extend(SECTIONS.into_iter().filter_map(end));
        }
        changes.sort_by_key(|(range, _)| range.start);
        changes
    }

    /// Writes a range of the text inside of an element. `suffixes` are those of the replicates around it, the
    /// outermost first.
    fn write(
        &self,
        node: Node,
        range: Range<usize>,
        suffixes: &[&str],
        written: &mut MjcfText,
    ) -> Result<(), SimError> {
        let mut from = range.start;
        for (place, change) in self.changes(node, suffixes.len()) {
            written.push_of(self.source, from..place.start);
            from = place.end;
            match change {
                TextChange::Removal => {}
                TextChange::Suffixes(depth) => {
                    let suffix: String = suffixes[..depth].iter().rev().copied().collect();
                    written.push_made(self.source, place.start, &suffix);
                }
                TextChange::Copies(number) => self.write_copies(number, suffixes, written)?,
                TextChange::Elements(section) => {
                    for CopiedElement { range, names } in self.elements.get(section).into_iter().flatten() {
                        let mut from = range.start;
                        for name in names {
                            written.push_of(self.source, from..name.end);
                            written.push_made(self.source, name.end, &name.suffix);
                            from = name.end;
                        }
                        written.push_of(self.source, from..range.end);
                    }
                }
            }
        }
        written.push_of(self.source, from..range.end);
        Ok(())
    }

    fn write_copies(&self, number: usize, suffixes: &[&str], written: &mut MjcfText) -> Result<(), SimError> {
        let Replicate { node, frames, suffixes: own } = &self.replicates[number];
        let Some(content) = inside(node) else { return Ok(()) };
        let start = node.range().start;
        for (frame, suffix) in frames.iter().zip(own) {
            let suffixes: Vec<&str> = suffixes.iter().copied().chain([suffix.as_str()]).collect();
            written.push_made(self.source, start, frame);
            self.write(*node, content.clone(), &suffixes, written)?;
            written.push_made(self.source, start, "</frame>");
            self.check_size(node, written.text.len())?;
        }
        Ok(())
    }
}

/// Returns the number of an element in its document.
fn number(node: &Node) -> usize {
    node.id().get_usize()
}

/// Returns the kind of an element that others name.
fn kind(node: &Node) -> Option<&'static str> {
    match node.tag_name().name() {
        "body" => Some("body"),
        "joint" | "freejoint" => Some("joint"),
        "geom" => Some("geom"),
        "site" => Some("site"),
        _ => None,
    }
}

/// Returns text in the escaped form of an attribute.
fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('"', "&quot;").replace('\'', "&apos;")
}
