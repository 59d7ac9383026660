//! The table in the form of `docs/src/mjcf.md`. `UPDATE_EXPECT=1` rewrites the page.

use super::{Attribute, Element, Support, Takes, all};

const PAGE: &str = concat!(env!("TANDEM_SIM_ASSETS"), "/../../docs/src/mjcf.md");

const INTRODUCTION: &str = "# MJCF support

Robots, scenes and objects are written in MJCF, MuJoCo's XML format, and one reader reads them all. It accepts or refuses
every element and every attribute by the table below; nothing is dropped silently. The table is a part of the program
(`sim/src/mjcf/support`), and a test keeps this page equal to it.

* **mapped**: it does what it does in MuJoCo.
* **approximated**: something like it happens, as the note says. The first place of each kind is named in the log when a
  scene is read.
* **ignored**: it has no effect on motion here, nor on what is drawn.
* **refused**: a file that has it is not read. The message names file, line and the nearest element that has a name, and says
  what to write instead, for all that is refused of a file at once. Where the table gives values, those are what happens
  anyway, and accepted. [`tandem import`](scenes.md#files-of-other-programs) writes such files in what is read.

Whatever is not in the table is refused too: a misspelt attribute, or one that a newer MuJoCo has. So are

* numbers that are not finite, too many or too few; masses below 0; quaternions of 0; two rotations on one element;
* a name that two elements of a kind have, and a class, material or texture that is not in the file;
* a `<compiler>` after a `<default>` that states angles, which it would change in MuJoCo;
* ranges whose smaller number comes second, `limited=\"true\"` without a range, and a range with neither `limited` nor
  `autolimits`;
* joints that move nothing that has mass, and shapes with an extent of 0;
* more than 200 elements inside one another.

A robot's file has one free body with all others on it, hinges with one `<position>` actuator each, called as the published
joints, sites `left_wrist`, `right_wrist`, `left_foot` and `right_foot`, a camera `egocentric` and a `<keyframe>` whose first
key it stands in; waist, arms and hands may lack joints. Of files that are otherwise, [a description](robots.md) says what is
what. An object's file has one body in the worldbody, and neither actuators nor keys.

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
