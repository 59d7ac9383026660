//! The support table of MJCF: its entry for every element and attribute decides whether a file is
//! accepted. `docs/src/mjcf.md` shows it.

mod bodies;
#[cfg(test)]
mod page;
mod sections;
pub(super) mod value;

/// Support of an element or an attribute.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Support {
    /// It has the same effect as in MuJoCo.
    Mapped,
    /// It has a similar effect, described in the note. A value in [`Takes::Only`] is exact.
    Approximated,
    /// It has no effect on motion or on the drawn image.
    Ignored,
    /// A file with it is refused. A value in [`Takes::Only`] is the actual behaviour, and accepted.
    Refused,
}

/// Element, given by its name and the elements that may contain it.
pub(super) struct Element {
    pub name: &'static str,
    pub within: &'static [&'static str],
    pub support: Support,
    /// Kind of the element; names are unique within a kind.
    pub kind: Option<&'static str>,
    pub attributes: &'static [&'static [Attribute]],
    pub note: &'static str,
}

/// Attributes of an element with the same support.
#[derive(Clone, Copy)]
pub(super) struct Attribute {
    pub names: &'static [&'static str],
    pub support: Support,
    pub takes: Takes,
    pub note: &'static str,
}

/// Values that an attribute accepts.
#[derive(Clone, Copy, Debug)]
pub(super) enum Takes {
    /// Any text.
    Text,
    /// A count of numbers between `least` and `most`.
    Numbers {
        least: usize,
        most: usize,
        sign: Sign,
    },
    /// This count of numbers. The first three give a direction.
    Direction(usize),
    /// Four numbers that are not all 0.
    Quaternion,
    /// Two directions of three numbers each that are not parallel.
    Axes,
    /// Three letters of `xyzXYZ`.
    AxisSequence,
    Word(&'static [&'static str]),
    /// The name of a default class.
    Class,
    /// The name of an element of this kind.
    NameOf(&'static str),
    /// One of these values. Other values are approximated or refused.
    Only(&'static [&'static str]),
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Sign {
    Any,
    NotNegative,
    Positive,
}

/// Returns the entry of an element inside another.
pub(super) fn element(within: &str, name: &str) -> Option<&'static Element> {
    all().find(|element| element.name == name && element.within.contains(&within))
}

/// Returns the names of the elements that another may contain.
pub(super) fn names_within(within: &str) -> Vec<&'static str> {
    let read = |element: &&Element| element.support != Support::Refused && element.within.contains(&within);
    all().filter(read).map(|element| element.name).collect()
}

fn all() -> impl Iterator<Item = &'static Element> {
    sections::ELEMENTS.iter().chain(bodies::ELEMENTS)
}

impl Element {
    pub fn attribute(&self, name: &str) -> Option<&'static Attribute> {
        self.attributes.iter().copied().flatten().find(|attribute| attribute.names.contains(&name))
    }
}

const fn attribute(
    support: Support,
    names: &'static [&'static str],
    takes: Takes,
    note: &'static str,
) -> Attribute {
    Attribute { names, support, takes, note }
}

const fn mapped(names: &'static [&'static str], takes: Takes) -> Attribute {
    attribute(Support::Mapped, names, takes, "")
}

const fn approximated(names: &'static [&'static str], note: &'static str) -> Attribute {
    attribute(Support::Approximated, names, Takes::Text, note)
}

const fn ignored(names: &'static [&'static str], note: &'static str) -> Attribute {
    attribute(Support::Ignored, names, Takes::Text, note)
}

const fn refused(names: &'static [&'static str], note: &'static str) -> Attribute {
    attribute(Support::Refused, names, Takes::Text, note)
}

/// Builds attributes that are refused unless they have the value that matches the actual behaviour.
const fn only(
    names: &'static [&'static str],
    values: &'static [&'static str],
    note: &'static str,
) -> Attribute {
    attribute(Support::Refused, names, Takes::Only(values), note)
}

const fn numbers(least: usize, most: usize) -> Takes {
    Takes::Numbers { least, most, sign: Sign::Any }
}

/// A number that is not negative.
const AMOUNT: Takes = Takes::Numbers { least: 1, most: 1, sign: Sign::NotNegative };
const NUMBER: Takes = numbers(1, 1);
const BOOLEAN: Takes = Takes::Word(&["true", "false"]);
const MAYBE: Takes = Takes::Word(&["true", "false", "auto"]);
const ANY_NUMBERS: Takes = numbers(0, usize::MAX);
const COLOR: Takes = Takes::Numbers { least: 4, most: 4, sign: Sign::NotNegative };

const NAME: Attribute = mapped(&["name"], Takes::Text);
const CLASS: Attribute = mapped(&["class"], Takes::Class);
const USER: Attribute = ignored(&["user"], "nobody asks for it");
/// Position and rotation, with at most one form of rotation.
const POSE: &[Attribute] = &[
    mapped(&["pos"], numbers(3, 3)),
    mapped(&["quat"], Takes::Quaternion),
    mapped(&["axisangle"], Takes::Direction(4)),
    mapped(&["euler"], numbers(3, 3)),
    mapped(&["xyaxes"], Takes::Axes),
    mapped(&["zaxis"], Takes::Direction(3)),
];
