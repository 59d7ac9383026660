//! Tests of robots from files: robots that lack joints, and robots that a description builds from third-party
//! MJCF.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use tandem_bench::single::{Subject, run};
use tandem_sim::assets::{self, DEFAULT_ROBOT};
use tandem_sim::{
    JOINTS, LocomotionChoice, RobotModel, RobotPlacement, RobotSource, Sensing, World, WorldSpec,
};

fn walker() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../gateway/examples/robots/walker.toml")
}

/// Returns the embedded robot's file without the fingers; 29 joints remain.
fn without_fingers() -> String {
    let mut text = assets::robot(DEFAULT_ROBOT).expect("embedded").to_string();
    let xml = roxmltree::Document::parse(&text).expect("XML");
    let is_finger = |name: &str| name.contains("_hand_");
    let gone = |node: &roxmltree::Node| match node.tag_name().name() {
        "body" | "position" => node.attribute("name").is_some_and(is_finger),
        "exclude" => node.attribute("body2").is_some_and(is_finger),
        "numeric" => true,
        _ => false,
    };
    let mut ranges: Vec<_> = xml.descendants().filter(gone).map(|node| node.range()).collect();
    ranges.retain({
        let all = ranges.clone();
        move |range| !all.iter().any(|other| other.start < range.start && range.end < other.end)
    });
    drop(xml);
    ranges.into_iter().rev().for_each(|range| text.replace_range(range, ""));
    text.replace("            0 0 0 0 0 0 0\n", "").replace("\n            0 0 0 0 0 0 0\"", "\"")
}

#[test]
fn a_robot_without_fingers_stands_with_joints_that_it_lacks_at_0() {
    let text = without_fingers();
    let model = RobotModel::parse("bare.xml", &text).expect("a robot");
    assert_eq!(
        (model.joints.len(), model.joints.iter().filter(|joint| joint.exists()).count()),
        (JOINTS, 29)
    );
    let whole = RobotSource::embedded(DEFAULT_ROBOT).expect("embedded").model;
    assert!(!model.has_fingers() && whole.has_fingers());
    assert!((0.5..1.5).contains(&(whole.mass_kg - model.mass_kg)), "{} kg", model.mass_kg);

    let placement = RobotPlacement { name: "A".into(), position_m: [0.0, 0.0], yaw_rad: 0.0 };
    let spec = WorldSpec { scene: "floor".into(), robots: vec![placement], objects: vec![] };
    let mut world = World::with_robot(&spec, Arc::new(model)).expect("a world");
    let mut command = world.rest_command(0);
    command.upper_rad[14..28].fill(0.7);
    let mut step = world.present();
    for _ in 0..150 {
        step = world.control_step(&[command]).expect("it stays finite");
    }
    let robot = &step.robots[0];
    assert!(!robot.truth.fallen && robot.truth.world_from_pelvis().translation.z > 0.7);
    let joints = &robot.sensed.joints;
    for fingers in [22..29, 36..43] {
        assert_eq!(
            (&joints.q_rad[fingers.clone()], &joints.torque_n_m[fingers]),
            (&[0.0; 7][..], &[0.0; 7][..])
        );
    }
}

/// The same controller as in the bench moves a robot of another size, with other names, a waist with yaw only
/// and arms with four joints.
#[test]
fn a_described_robot_stands_walks_and_squats() {
    let model = Arc::new(RobotSource::read(&walker()).expect("a robot").model);
    assert_eq!(model.joints.iter().filter(|joint| joint.exists()).count(), 21);
    assert!(model.scale.length_m(1.0) < 0.9, "its legs are shorter than a G1's: {:?}", model.scale);
    for case in ["stand", "forward_0.4", "squat", "push_40n"] {
        let robot = "walker";
        let subject = Subject::Base(&LocomotionChoice::Balance);
        let report = run(robot, &model, subject, Sensing::default(), case, &(0..=0), |_| {});
        let report = report.expect("a report");
        let found = report.cases.iter().find(|found| found.case == case).expect("the case");
        assert_eq!(found.survived, 1, "{found:?}");
    }
}

/// Returns the error for the description with `from` replaced by `to`.
#[track_caller]
fn refusal(from: &str, to: &str) -> String {
    let text = std::fs::read_to_string(walker()).expect("the description");
    assert!(text.contains(from), "{from}");
    let folder = tempfile::tempdir().expect("a temporary folder");
    let mjcf = std::fs::read_to_string(walker().with_extension("xml")).expect("the MJCF");
    std::fs::write(folder.path().join("walker.xml"), mjcf).expect("a file");
    let path = folder.path().join("walker.toml");
    std::fs::write(&path, text.replacen(from, to, 1)).expect("a file");
    RobotSource::read(&path).map(|_| ()).expect_err(to).to_string()
}

#[test]
fn what_a_description_gets_wrong_is_told_with_what_would_be_right() {
    for (from, to, expected) in [
        ("left_knee_joint = \"knee_l\"\n", "", "nothing says which joint `knee_l` of walker.xml is"),
        ("nod = 0.0", "", "give it an angle in [held_rad]"),
        (
            "left_knee_joint =",
            "left_nee_joint =",
            "[joints] has `left_nee_joint`; a robot's joints are called: left_hip_pitch_joint",
        ),
        ("\"knee_l\"", "\"knie_l\"", "names `knie_l`, and walker.xml has no such joint; it has: swing_l"),
        (
            "left_knee_joint = \"knee_l\"",
            "left_wrist_yaw_joint = \"knee_l\"",
            "needs a joint `left_knee_joint`",
        ),
        ("body = \"forearm_l\"", "body = \"hand_l\"", "walker.xml has no body `hand_l`"),
        ("body = \"head\"", "body = \"eyes\"", "walker.xml has no body `eyes`"),
        ("down_deg = 25", "downwards_deg = 25", "does not describe a robot"),
        ("model = \"walker.xml\"", "model = \"runner.xml\"", "runner.xml"),
    ] {
        let error = refusal(from, to);
        assert!(error.contains(expected), "{to}: {error}");
    }
}
