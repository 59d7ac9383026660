//! Default classes with the semantics of MuJoCo, where those of `mjcf-rs` differ. Attributes that an element
//! inherits in part are written on the element.

use std::ops::Range;

use roxmltree::{Document, Node};

use super::stated::Classes;

/// Actuators that share one set of defaults in a class of MuJoCo.
const ACTUATORS: [&str; 6] = ["general", "motor", "position", "velocity", "intvelocity", "damper"];
/// Attributes that these actuators share.
const SHARED: [&str; 5] = ["ctrlrange", "forcerange", "ctrllimited", "forcelimited", "gear"];
/// Attributes that give a rotation; an element has at most one.
const ROTATIONS: [&str; 5] = ["quat", "axisangle", "euler", "xyaxes", "zaxis"];
/// Attributes with several numbers, of which an element may state only the first ones.
const LISTS: [&str; 2] = ["size", "friction"];

/// Range of the text and its replacement.
type Edit = (Range<usize>, String);

/// Returns the text of a file in which no attribute comes partly from an element and partly from its
/// classes.
pub(in crate::mjcf) fn plain(text: &str, xml: &Document) -> String {
    let mut edits: Vec<Edit> = Vec::new();
    let classes = Classes::of(xml);
    for node in xml.descendants().filter(Node::is_element) {
        let within = |name: &str| node.ancestors().any(|one| one.has_tag_name(name));
        match node.tag_name().name() {
            "geom" | "site" if within("worldbody") => {
                let levels = levels(&node, &classes);
                add_pose(&levels, &mut edits);
                LISTS.iter().for_each(|list| add_list(&levels, list, &mut edits));
            }
            // `mjcf-rs` accepts only true and false.
            "body" => edits.extend(node.attribute_node("sleep").map(|sleep| (sleep.range(), String::new()))),
            "general" | "motor" | "position" if within("actuator") => add_shared(&node, &classes, &mut edits),
            _ => {}
        }
    }
    edits.sort_by_key(|(range, _)| range.start);
    let (mut plain, mut from) = (String::with_capacity(text.len()), 0);
    for (range, instead) in edits {
        plain.push_str(&text[from..range.start]);
        plain.push_str(&instead);
        from = range.end;
    }
    plain + &text[from..]
}

/// Returns the elements that supply attributes for this one: itself, then its classes, the nearest first.
fn levels<'a, 'i: 'a>(node: &Node<'a, 'i>, classes: &Classes<'a, 'i>) -> Vec<Node<'a, 'i>> {
    let of_class = |class: Node<'a, 'i>| {
        let name = node.tag_name();
        class.children().filter(move |child| child.tag_name() == name).collect::<Vec<_>>()
    };
    std::iter::once(*node).chain(classes.of_element(node).into_iter().flat_map(of_class)).collect()
}

/// Adds position and rotation, each from the nearest level that has it.
fn add_pose(levels: &[Node], edits: &mut Vec<Edit>) {
    let next = |names: &[&'static str]| {
        levels.iter().enumerate().find_map(|(level, one)| {
            let name = names.iter().find(|name| one.has_attribute(**name))?;
            Some((level, *name, one.attribute(*name)?))
        })
    };
    let (Some(position), Some(rotation)) = (next(&["pos"]), next(&ROTATIONS)) else { return };
    if position.0 == rotation.0 {
        return;
    }
    for (level, name, value) in [position, rotation] {
        if level > 0 {
            edits.push(inserted(&levels[0], name, value));
        }
    }
}

/// Completes the numbers of an element with those of its classes.
fn add_list(levels: &[Node], name: &str, edits: &mut Vec<Edit>) {
    let stated: Vec<Vec<&str>> = levels
        .iter()
        .filter_map(|one| Some(one.attribute(name)?.split_ascii_whitespace().collect()))
        .collect();
    let Some(nearest) = stated.first() else { return };
    let longest = stated.iter().map(Vec::len).max().unwrap_or(0);
    if nearest.len() == longest {
        return;
    }
    let number = |at: usize| stated.iter().find_map(|numbers| numbers.get(at)).copied().unwrap_or("0");
    let all: Vec<&str> = (0..longest).map(number).collect();
    match levels[0].attribute_node(name) {
        Some(own) => edits.push((own.range_value(), all.join(" "))),
        None => edits.push(inserted(&levels[0], name, &all.join(" "))),
    }
}

/// Adds the attributes that the nearest class has for any kind of actuator.
fn add_shared<'a, 'i: 'a>(node: &Node<'a, 'i>, classes: &Classes<'a, 'i>, edits: &mut Vec<Edit>) {
    for name in SHARED.iter().filter(|name| !node.has_attribute(**name)) {
        let of_class = |class: Node| {
            let mut elements = class.children().filter(|child| ACTUATORS.contains(&child.tag_name().name()));
            elements.find_map(|child| child.attribute(*name).map(String::from))
        };
        if let Some(value) = classes.of_element(node).into_iter().find_map(of_class) {
            edits.push(inserted(node, name, &value));
        }
    }
}

/// Returns the edit that inserts an attribute after the name of an element.
fn inserted(node: &Node, name: &str, value: &str) -> Edit {
    let at = node.range().start + 1 + node.tag_name().name().len();
    (at..at, format!(" {name}=\"{value}\""))
}

#[cfg(test)]
mod tests {
    use crate::mjcf::{ActuatorKind, Document};

    #[test]
    fn an_element_has_of_its_classes_what_it_does_not_state() {
        let document = Document::parse(
            "room.xml",
            r#"<mujoco><default><geom type="box" size="1 2 3" friction="0.5 0.1 0.2"/>
                 <default class="turned"><geom quat="0 0 0 1" pos="5 0 0"/></default></default>
               <worldbody><geom class="turned" pos="0 1 0" size="4" friction="0.7"/>
                 <geom class="turned" quat="1 0 0 0"/></worldbody></mujoco>"#,
        )
        .expect("a room");
        let geoms = &document.trees().expect("trees")[0].links[0].geoms;
        let first = &geoms[0];
        assert_eq!(first.body_from_geom.translation.to_array(), [0.0, 1.0, 0.0]);
        assert!(
            (first.body_from_geom.rotation.z.abs() - 1.0).abs() < 1e-6,
            "{}",
            first.body_from_geom.rotation
        );
        assert_eq!((first.friction.slide, first.friction.roll_m), (0.7, 0.2));
        let crate::mjcf::Primitive::Box { half_extents_m } = first.primitive else { panic!("a box") };
        assert_eq!(half_extents_m.to_array(), [4.0, 2.0, 3.0]);
        assert_eq!(geoms[1].body_from_geom.translation.to_array(), [5.0, 0.0, 0.0]);
        assert_eq!(geoms[1].body_from_geom.rotation.z, 0.0);
    }

    #[test]
    fn actuators_of_all_kinds_have_one_set_of_defaults() {
        let actuators = Document::parse(
            "room.xml",
            r#"<mujoco><default><motor ctrlrange="-1 1" ctrllimited="true"/>
                 <default class="strong"><general forcerange="-9 9" forcelimited="true"/></default></default>
               <worldbody><body><joint name="h"/><geom size="1"/></body></worldbody>
               <actuator><position class="strong" joint="h" kp="3" gear="2"/></actuator></mujoco>"#,
        )
        .expect("a room")
        .actuators()
        .expect("actuators");
        assert_eq!(actuators[0].control_range, Some([-1.0, 1.0]));
        assert_eq!(actuators[0].effort_range, Some([-18.0, 18.0]), "at the joint, behind the gear");
        assert_eq!(actuators[0].kind, ActuatorKind::Position { kp: 12.0, kd: 0.0 });
    }

    #[test]
    fn general_actuators_act_if_they_are_motors_or_positions() {
        let read = |general: &str| {
            let body = r#"<worldbody><body><joint name="h"/><geom size="1"/></body></worldbody>"#;
            let general = format!(r#"<actuator><general joint="h" {general}/></actuator>"#);
            let xml = format!("<mujoco>{body}{general}</mujoco>");
            let document = Document::parse("room.xml", &xml).expect("a room");
            let found = document.actuators().expect("actuators");
            let acts = found.first().map(|actuator| (actuator.kind, actuator.gear));
            assert_eq!(acts.is_none(), document.approximations().len() == 1, "a note if it does nothing");
            acts
        };
        assert_eq!(read(r#"gainprm="7" gear="2""#), Some((ActuatorKind::Motor, 14.0)));
        let position = ActuatorKind::Position { kp: 9.0, kd: 1.0 };
        assert_eq!(read(r#"gainprm="9" biastype="affine" biasprm="0 -9 -1""#), Some((position, 1.0)));
        assert_eq!(read(r#"gainprm="9" biastype="affine" biasprm="0 -8 -1""#), None);
        assert_eq!(read(r#"dyntype="integrator""#), None);
    }
}
