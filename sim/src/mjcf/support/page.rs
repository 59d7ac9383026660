//! The table in the form of `docs/src/mjcf.md`. `UPDATE_EXPECT=1` rewrites the page.

use super::{Attribute, Element, Support, Takes, all};

const PAGE: &str = concat!(env!("TANDEM_SIM_ASSETS"), "/../../docs/src/mjcf.md");

const INTRODUCTION: &str = "# MJCF support

Robots, scenes and objects are written in MJCF, MuJoCo's XML format, and the same reader parses all of them. It accepts
or refuses every element and every attribute by the table below; nothing is dropped silently. The table is a part of
the program (`sim/src/mjcf/support`), and a test keeps this page equal to it.

* **mapped**: it has the same effect as in MuJoCo.
* **approximated**: it has a similar effect, which the note describes. When a scene is read, the log names the first
  occurrence of each kind.
* **ignored**: it affects neither motion nor images.
* **refused**: a file that contains it is not read. The message lists all refused parts of a file at once. It names
  file, line and the nearest named element, and says what to write instead. Values in the table are accepted, since
  they describe what happens anyway. [`tandem import`](scenes.md#files-of-other-programs) converts refused files to
  supported MJCF.

Everything that is not in the table is refused, too, for example a misspelt attribute, or one of a newer MuJoCo. So are

* numbers that are not finite, too many or too few; masses below 0; quaternions of 0; two rotations on one element;
* a name that two elements of one kind share, and a class, material or texture that is not in the file;
* a `<compiler>` after a `<default>` with angles, whose meaning it would change in MuJoCo;
* ranges whose smaller number comes second, `limited=\"true\"` without a range, and a range with neither `limited` nor
  `autolimits`;
* joints that move no mass, and shapes with an extent of 0;
* more than 200 levels of nested elements.

A robot's file has one free body that carries all others, and hinges with the names of the published joints and one
`<position>` actuator each; waist, arms and hands may lack joints. It has sites `left_wrist`, `right_wrist`, `left_foot`
and `right_foot`, a camera `egocentric`, and a `<keyframe>` whose first key is a standing pose. For other files, [a
description](robots.md) assigns their parts. An object's file has one body in the worldbody, and neither actuators nor
keys.

Angles are degrees unless `<compiler angle=\"radian\"/>` says otherwise, as in MuJoCo.

";

fn page() -> String {
    let mut page = INTRODUCTION.to_string();
    page += "| element | attributes | | |\n|---|---|---|---|\n";
    for element in all() {
        page += &element_row(element);
        let attributes: Vec<&Attribute> = element.attributes.iter().copied().flatten().collect();
        for alike in attributes.chunk_by(|one, next| happens(one) == happens(next)) {
            page += &attribute_row(alike);
        }
    }
    page
}

fn element_row(element: &Element) -> String {
    let within: Vec<String> =
        element.within.iter().filter(|one| !one.is_empty()).map(|one| format!("`{one}`")).collect();
    let within = match within.as_slice() {
        [] => String::new(),
        _ if element.within.contains(&"any") => " in any element".into(),
        within => format!(" in {}", within.join(", ")),
    };
    format!(
        "| **`<{}>`**{within} | | {} | {} |\n",
        element.name,
        word(element.support),
        escaped(element.note)
    )
}

fn attribute_row(alike: &[&Attribute]) -> String {
    let names: Vec<String> = alike.iter().flat_map(|one| one.names).map(|name| format!("`{name}`")).collect();
    let (support, note) = happens(alike[0]);
    format!("| | {} | {support} | {} |\n", names.join(", "), escaped(note))
}

/// Returns the support of an attribute, and the note.
fn happens(attribute: &Attribute) -> (String, &'static str) {
    let support = match attribute.takes {
        Takes::Only(values) => {
            let values: Vec<String> = values.iter().map(|value| format!("`{value}`")).collect();
            format!("{} unless {}", word(attribute.support), values.join(" or "))
        }
        _ => word(attribute.support).to_string(),
    };
    (support, attribute.note)
}

fn word(support: Support) -> &'static str {
    match support {
        Support::Mapped => "mapped",
        Support::Approximated => "approximated",
        Support::Ignored => "ignored",
        Support::Refused => "refused",
    }
}

/// Escapes angle brackets, which would be HTML.
fn escaped(note: &str) -> String {
    note.replace('<', "&lt;").replace('>', "&gt;")
}

#[test]
fn the_page_shows_the_table() {
    if std::env::var_os("UPDATE_EXPECT").is_some() {
        std::fs::write(PAGE, page()).expect("the page can be written");
    }
    let have = std::fs::read_to_string(PAGE).expect("the page");
    assert!(have == page(), "docs/src/mjcf.md is not what the table says; UPDATE_EXPECT=1 writes it again");
}

#[test]
fn an_element_has_one_row_in_each_place() {
    let mut places: Vec<(&str, &str)> =
        all().flat_map(|element| element.within.iter().map(|within| (element.name, *within))).collect();
    places.sort_unstable();
    let count = places.len();
    places.dedup();
    assert_eq!(places.len(), count, "an element is in the table twice");
    for element in all() {
        let mut names: Vec<&str> =
            element.attributes.iter().copied().flatten().flat_map(|one| one.names).copied().collect();
        names.sort_unstable();
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]), "an attribute of <{}> twice", element.name);
    }
}
