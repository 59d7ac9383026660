//! Copies are those of MuJoCo 4.0.0: names, poses and order.

use crate::SimError;
use crate::mjcf::Document;

fn read(inside: &str) -> Result<Document, SimError> {
    Document::parse("room.xml", &format!("<mujoco>\n{inside}</mujoco>"))
}

/// Returns the name, and the position and rotation (w first) in the world, of every body.
fn poses(document: &Document) -> Vec<(String, [f64; 7])> {
    let mut world_from_body = Vec::new();
    for entry in &document.model.bodies {
        let pose = entry.parent.map_or(entry.body.pose, |parent| world_from_body[parent] * entry.body.pose);
        world_from_body.push(pose);
    }
    let named = document.model.bodies.iter().zip(world_from_body).skip(1);
    let numbers = named.map(|(entry, pose)| {
        let ([x, y, z], [i, j, k, w]) = (pose.translation.to_array(), pose.rotation.to_array());
        (entry.body.name.clone().unwrap_or_default(), [x, y, z, w, i, j, k])
    });
    numbers.collect()
}

fn check(document: &Document, expected: &[(&str, [f64; 7])]) {
    let found = poses(document);
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((name, found), (expected_name, expected)) in found.iter().zip(expected) {
        let is_near = found.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-4);
        assert!(
            name == expected_name && is_near,
            "{name}: {found:?} instead of {expected_name}: {expected:?}"
        );
    }
}

#[test]
fn each_copy_is_offset_and_turned_from_the_one_before() {
    let document = read(
        r#"<compiler angle="radian" eulerseq="XYZ"/>
        <actuator><motor name="push" joint="hinge"/><motor name="own" joint="first"/></actuator>
        <worldbody><body name="a"><joint name="first"/><geom size="0.1"/></body>
        <replicate count="3" offset="1 2 3" euler="0.3 0.2 0.1"><body name="b" pos="0 0 1">
        <joint name="hinge"/><geom name="g" size="0.1" pos="0.5 0 0"/></body></replicate>
        <body name="z"><joint name="last"/><geom size="0.1"/></body></worldbody>
        <actuator><motor name="late" joint="last"/></actuator>"#,
    )
    .expect("a room");
    check(
        &document,
        &[
            ("a", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
            ("b0", [0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
            ("b1", [1.21835, 1.7249, 3.93629, 0.98335, 0.14357, 0.10602, 0.03427]),
            ("b2", [2.98348, 2.69587, 6.94965, 0.93748, 0.26923, 0.21776, 0.03506]),
            ("z", [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
        ],
    );
    let actuators = document.actuators().expect("actuators");
    let joints: Vec<&str> = actuators.iter().map(|actuator| actuator.joint.as_str()).collect();
    assert_eq!(joints, ["first", "last", "hinge0", "hinge1", "hinge2"]);
}

#[test]
fn a_replicate_in_another_is_copied_with_it() {
    let document = read(
        r#"<compiler eulerseq="zyx"/>
        <default><default class="red"><geom rgba="1 0 0 1"/></default></default>
        <worldbody><body name="a"><geom name="ga" size="0.1"/></body>
        <replicate count="2" offset="0 1 0" sep="-"><frame name="f" pos="0 0 5">
        <replicate count="2" offset="1 0 0" euler="90 45 0" childclass="red">
        <body name="b" pos="0 2 0"><freejoint name="free"/><geom name="g" size="0.1"/></body>
        </replicate></frame></replicate></worldbody>
        <contact><exclude name="ex" body1="a" body2="b"/><pair geom1="ga" geom2="g"/></contact>"#,
    )
    .expect("a room");
    let turned = [0.65328, -0.2706, 0.2706, 0.65328];
    let at = |[x, y, z]: [f64; 3], [w, i, j, k]: [f64; 4]| [x, y, z, w, i, j, k];
    let straight = [1.0, 0.0, 0.0, 0.0];
    check(
        &document,
        &[
            ("a", at([0.0; 3], straight)),
            ("b0-0", at([0.0, 2.0, 5.0], straight)),
            ("b1-0", at([-1.0, 0.0, 5.0], turned)),
            ("b0-1", at([0.0, 3.0, 5.0], straight)),
            ("b1-1", at([-1.0, 1.0, 5.0], turned)),
        ],
    );
    let names = ["0-0", "1-0", "0-1", "1-1"];
    let excludes = document.model.contact.excludes.iter();
    let apart: Vec<_> = excludes.map(|pair| (pair.body1.clone(), pair.body2.clone())).collect();
    assert_eq!(apart, names.map(|name| ("a".to_string(), format!("b{name}"))));
    assert_eq!(document.pairs.len(), 4);
    for (pair, name) in document.pairs.iter().zip(names) {
        assert!(pair.has("ga") && pair.has(&format!("g{name}")), "{pair:?}");
    }
    let trees = document.trees().expect("trees");
    assert!(trees[2..].iter().all(|tree| tree.links[0].geoms[0].rgba == [1.0, 0.0, 0.0, 1.0]));
}

#[test]
fn numbers_of_copies_have_as_many_digits_as_the_count() {
    let document = read(
        r#"<worldbody><body name="rack"><geom size="0.1"/>
        <replicate count="11" offset="0.5 0 0" euler="0 0 10" sep="_"><body name="peg"><joint name="tilt"/>
        <geom size="0.1"/><joint name="turn" axis="1 0 0"/></body></replicate></body></worldbody>
        <equality><joint joint1="tilt" joint2="turn"/></equality>"#,
    )
    .expect("a room");
    let bodies = poses(&document);
    // Each body with two joints is two bodies here.
    assert_eq!(bodies.len(), 1 + 2 * 11);
    let (name, pose) = &bodies[22];
    assert_eq!(name, "peg_10");
    let expected = [3.10751, 3.10751, 0.0, 0.64279, 0.0, 0.0, 0.76604];
    assert!(pose.iter().zip(expected).all(|(found, expected)| (found - expected).abs() < 1e-4), "{pose:?}");
    let equalities = document.equalities().expect("equalities");
    assert_eq!(equalities.len(), 11);
}

#[test]
fn what_is_wrong_with_a_replicate_or_its_copies_is_told_with_its_line() {
    let body = r#"<body name="b"><joint name="j"/><geom size="1"/></body>"#;
    let copied = |attributes: &str, rest: &str| {
        format!(
            "<worldbody>\n<replicate {attributes}>\n{body}</replicate><body name=\"a\"><geom size=\"1\"/></body></worldbody>\n{rest}"
        )
    };
    let two = format!(
        "<worldbody><replicate count=\"2\">{body}</replicate><replicate count=\"2\"><body name=\"c\"><geom size=\"1\"/></body></replicate></worldbody>"
    );
    for (inside, expected) in [
        (copied("", ""), "`room.xml:3`: replicate in <worldbody>: it needs a `count`"),
        (copied(r#"count="2.5""#, ""), "it needs a `count`, a whole number of at most 100000"),
        (copied(r#"count="2" offset="1 2""#, ""), r#"offset="1 2"; use 3 numbers"#),
        (copied(r#"count="2" size="1""#, ""), "<replicate> has no attribute `size` that is read"),
        (
            copied(r#"count="2""#, "<actuator><motor joint=\"k\"/></actuator>"),
            "no hinge or slide `k`; have: j0, j1",
        ),
        (
            copied(r#"count="2""#, "<equality><weld body1=\"b\" body2=\"a\"/></equality>"),
            "`room.xml:5`: weld in <equality>: MuJoCo leaves out equalities between copies and other things",
        ),
        (
            format!("{two}<contact><exclude body1=\"b\" body2=\"c\"/></contact>"),
            "it names things in two <replicate>",
        ),
        (copied(r#"count="2""#, "").replace("<geom size=\"1\"/>", "<geom siz=\"1\"/>"), "room.xml:4"),
        (
            copied(r#"count="100000""#, "").replace("name=\"j\"", &format!("name=\"{}\"", "j".repeat(500))),
            "more than 16 MB",
        ),
    ] {
        let found = read(&inside).and_then(|document| document.actuators());
        let error = found.expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}\ninstead of {expected}");
    }
}
