//! Tests of robots built from descriptions: the example walker with reordered joints, fewer joints, other
//! frames, and content that robots do not use.

use std::path::Path;
use std::sync::Arc;

use tandem_bench::single::{Subject, run};
use tandem_episodes::RobotFile;
use tandem_evaluation::check_robot;
use tandem_sim::{LocomotionChoice, RobotDraft, RobotModel, RobotSource, Sensing, Side, Vector};

fn text(name: &str) -> String {
    let examples = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../gateway/examples/robots");
    std::fs::read_to_string(examples.join(name)).expect("an example")
}

/// Applies the replacements to the text. Each text to replace must occur.
#[track_caller]
fn replaced(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_string(), |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    })
}

/// Returns the walker's MJCF with the lines of two joints exchanged on each side.
fn exchanged(first: &str, second: &str) -> String {
    let mut lines: Vec<String> = text("walker.xml").lines().map(str::to_string).collect();
    for side in ["l", "r"] {
        let at = |name: &str| {
            let joint = format!("joint name=\"{name}_{side}\"");
            lines.iter().position(|line| line.contains(&joint)).expect("a joint")
        };
        let (first, second) = (at(first), at(second));
        lines.swap(first, second);
    }
    lines.join("\n")
}

fn without(text: &str, words: &[&str]) -> String {
    let kept = text.lines().filter(|line| words.iter().all(|word| !line.contains(word)));
    kept.collect::<Vec<_>>().join("\n")
}

fn read(mjcf: &str, description: &str) -> Result<RobotSource, String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("walker.xml"), mjcf).expect("a file");
    let path = folder.path().join("walker.toml");
    std::fs::write(&path, description).expect("a file");
    RobotSource::read(&path)
        .map_err(|error| error.to_string().replace(&folder.path().display().to_string(), ""))
}

#[track_caller]
fn model(mjcf: &str, description: &str) -> Arc<RobotModel> {
    Arc::new(read(mjcf, description).unwrap_or_else(|error| panic!("{error}")).model)
}

/// Checks that a robot survives a case of the bench.
#[track_caller]
fn check_survives(model: &Arc<RobotModel>, case: &str) {
    let subject = Subject::Base(&LocomotionChoice::Balance);
    let report = run("walker", model, subject, Sensing::default(), case, &(0..=0), |_| {});
    let report = report.expect("a report");
    let found = report.cases.iter().find(|found| found.case == case).expect("the case");
    assert_eq!(found.survived, 1, "{found:?}");
}

/// A robot behaves the same for any order of the joints in a limb. The controller, loads on hands and frames
/// of feet depend only on the kinematic tree.
#[test]
fn joints_of_a_limb_may_have_any_order() {
    for (first, second, case) in [
        ("tip", "roll", "forward_0.4"),
        ("swing", "twist", "forward_0.4"),
        ("raise", "lift", "stand_1kg"),
        ("raise", "turn", "stand_1kg"),
        ("lift", "turn", "stand_1kg"),
    ] {
        let model = model(&exchanged(first, second), &text("walker.toml"));
        let foot = model.soles[Side::Left].link;
        assert_eq!(model.links[foot].name, "foot_l", "{first}, {second}");
        check_survives(&model, case);
    }
}

/// Tests mirrored motors, which small servo robots have: the right knee and both ankles turn the other way.
#[test]
fn legs_bend_whichever_way_their_motors_turn() {
    let turned = replaced(
        &text("walker.xml"),
        &[
            (r#"name="knee_r" axis="0 1 0" range="0 2.4""#, r#"name="knee_r" axis="0 -1 0" range="-2.4 0""#),
            (
                r#"name="tip_l" axis="0 1 0" range="-0.9 0.6""#,
                r#"name="tip_l" axis="0 -1 0" range="-0.6 0.9""#,
            ),
            (
                r#"name="tip_r" axis="0 1 0" range="-0.9 0.6""#,
                r#"name="tip_r" axis="0 -1 0" range="-0.6 0.9""#,
            ),
        ],
    );
    let usual = model(&text("walker.xml"), &text("walker.toml"));
    let turned = model(&turned, &text("walker.toml"));
    for (joint, sign) in [(0, 1.0), (3, 1.0), (4, -1.0), (6, 1.0), (9, -1.0), (10, -1.0)] {
        let (was, is) = (usual.joints[joint].rest_rad, turned.joints[joint].rest_rad);
        assert!(
            was.abs() > 0.1 && (was * sign - is).abs() < 1e-3,
            "{}: {was}, {is}",
            usual.joints[joint].name
        );
    }
    check_survives(&turned, "forward_0.4");
}

/// Without a roll joint in the ankle, the foot rolls about the midline of its sole. The capsule has this
/// shape.
#[test]
fn a_robot_whose_ankles_do_not_roll_stands_and_walks() {
    let mjcf = without(&text("walker.xml"), &["joint name=\"roll_"]);
    let mjcf = replaced(
        &mjcf,
        &[(
            r#"type="box" pos="0.025 0 -0.018" size="0.085 0.034 0.012""#,
            r#"type="capsule" fromto="-0.06 0 -0.018 0.11 0 -0.018" size="0.012""#,
        )],
    );
    let model = model(&mjcf, &without(&text("walker.toml"), &["ankle_roll"]));
    assert!(model.leg_chains.iter().all(|chain| chain.len() == 5));
    check_survives(&model, "stand_waving");
    check_survives(&model, "forward_0.4");
}

/// Origins and axes of body frames are a convention of the file. The robot behaves the same.
#[test]
fn frames_of_bodies_do_not_matter() {
    // The foot's frame is rotated by 90 degrees about x; the knee joint is not at its body's origin.
    let turned = replaced(
        &text("walker.xml"),
        &[(
            r#"<body name="foot_l" pos="0 0 -0.015">"#,
            r#"<body name="foot_l" pos="0 0 -0.015" euler="1.5707963267948966 0 0">"#,
        )],
    );
    let (before, rest) = turned.split_once(r#"<body name="foot_l""#).expect("a foot");
    let (foot, after) = rest.split_once("</body>").expect("its end");
    let foot = replaced(
        foot,
        &[
            (
                r#"pos="0.02 0 -0.018" mass="0.55" diaginertia="0.0006 0.0014 0.0014""#,
                r#"pos="0.02 -0.018 0" mass="0.55" diaginertia="0.0006 0.0014 0.0014""#,
            ),
            (
                r#"pos="0.025 0 -0.018" size="0.085 0.034 0.012""#,
                r#"pos="0.025 -0.018 0" size="0.085 0.012 0.034""#,
            ),
        ],
    );
    let turned = format!("{before}<body name=\"foot_l\"{foot}</body>{after}");
    let usual = model(&text("walker.xml"), &text("walker.toml"));
    let turned = model(&turned, &text("walker.toml"));
    for side in Side::BOTH {
        let [was, is] = [&usual, &turned].map(|model| &model.soles[side]);
        let apart_m = (was.link_from_site.translation - is.link_from_site.translation).length();
        assert!(apart_m < 1e-5, "{was:?} {is:?}");
        let [was, is] = [&usual, &turned].map(|model| model.links[model.soles[side].link].mass.local_com);
        assert!((was - is).length() < 1e-5, "{was} {is}");
    }
    assert!((usual.scale.length_m(1.0) - turned.scale.length_m(1.0)).abs() < 1e-5);
    check_survives(&turned, "forward_0.4");
}

#[test]
fn content_that_a_described_robot_does_not_use_is_left_out_with_a_note() {
    let more = r#"<geom type="plane" size="5 5 0.1"/><body name="mark"/><light pos="0 0 3"/>
        <body name="hips" "#;
    let end = r#"<equality><joint joint1="bend_l" joint2="bend_r"/></equality>
        <tendon><fixed name="cord"><joint joint="bend_l" coef="1"/></fixed></tendon>
        <sensor><jointpos joint="bend_l"/></sensor>
        <actuator><position joint="bend_l" kp="3" dampratio="1"/><velocity joint="bend_r" kv="1"/></actuator>
        <keyframe><key qpos="0"/></keyframe></mujoco>"#;
    let changes = [("<body name=\"hips\" ", more), ("</mujoco>", end)];
    let mut changed = replaced(&text("walker.xml"), &changes);
    changed = changed.replace("<keyframe><key qpos=\"0\"/></keyframe>", "");
    let usual = model(&text("walker.xml"), &text("walker.toml"));
    let with_more = model(&changed, &text("walker.toml"));
    assert_eq!(with_more.mass_kg, usual.mass_kg);
    assert_eq!(with_more.links.len(), usual.links.len());
    let notes = with_more.approximations.join("\n");
    for note in
        ["bodies beside", "geoms in the worldbody", "equalities are left out", "gains of actuators", "tendon"]
    {
        assert!(notes.contains(note), "{note}: {notes}");
    }
}

#[test]
fn a_robot_without_arms_is_read() {
    let whole = text("walker.xml");
    let (before, rest) = whole.split_once("<body name=\"shoulder_l\"").expect("a shoulder");
    let (_, head) = rest.split_once("<body name=\"head\"").expect("a head");
    let mjcf = format!("{before}<body name=\"head\"{head}");
    let mjcf = without(&mjcf, &["body2=\"upper_"]);
    let description = text("walker.toml");
    let (joints, camera) = (
        description.split("# The file has no key").next().expect("joints"),
        "[camera]\nbody = \"head\"\nposition_m = [0.07, 0, 0.06]\ndown_deg = 25\n",
    );
    let model = model(&mjcf, &(without(joints, &["shoulder", "elbow"]) + "\n" + camera));
    assert_eq!(model.joints.iter().filter(|joint| joint.exists()).count(), 13);
    check_survives(&model, "stand_waving");
}

/// One error lists all reasons, each with the file and the line, or the entry, and the correct form.
#[test]
fn all_reasons_to_refuse_a_robot_come_at_once() {
    let mjcf = replaced(
        &text("walker.xml"),
        &[
            (r#"name="knee_l" axis="0 1 0" range="0 2.4""#, r#"name="knee_l" axis="0 1 0""#),
            (r#"name="swing_r" axis="0 1 0""#, r#"name="swing_r" axis="0 1 0" stiffness="3""#),
            (r#" actuatorfrcrange="-24 24""#, ""),
            (
                r#"<geom class="shell" type="box" pos="0.025 0 -0.018" size="0.085 0.034 0.012" friction="0.7"/>"#,
                "",
            ),
        ],
    );
    let described = replaced(
        &text("walker.toml"),
        &[
            ("left_elbow_joint = \"bend_l\"", "left_elbow_joint = \"bent_l\""),
            ("left_elbow_joint = -0.3", "left_elbo_joint = -0.3"),
            ("body = \"forearm_l\"", "body = \"hand_l\""),
            ("body = \"head\"", "body = \"eyes\""),
        ],
    );
    let error = read(&mjcf, &described).map(|_| ()).expect_err("refused");
    for reason in [
        "[rest_rad] has `left_elbo_joint`; a robot's joints are called: left_hip_pitch_joint",
        "[joints] names `bent_l`, and walker.xml has no such joint; it has: swing_l",
        "says which joint `bend_l` of walker.xml is: name it in [joints], or give it an angle in [held_rad]",
        "[left_wrist]: walker.xml has no body `hand_l`; it has: hips",
        "[camera]: walker.xml has no body `eyes`; it has: hips",
        "needs a range, or one for `left_knee_joint` in [range_rad]",
        "has a spring; leave out its stiffness",
        "has no limit of effort for `left_shoulder_pitch_joint`, `left_shoulder_roll_joint`, `right_shoulder_pitch_joint`",
        "is a foot without a geom that collides",
    ] {
        assert!(error.contains(reason), "{reason}: {error}");
    }
    let place = |joint: &str| {
        format!("walker.xml:{}`", 1 + mjcf.lines().position(|line| line.contains(joint)).expect(joint))
    };
    for joint in ["name=\"knee_l\"", "name=\"swing_r\"", "body name=\"foot_l\"", "name=\"bend_l\""] {
        assert!(error.contains(&place(joint)), "{}: {error}", place(joint));
    }
}

/// A draft assigns the same joints as the example, regardless of the names in the file.
#[test]
fn a_draft_finds_the_joints_of_a_robot() {
    let numbered = {
        let mut text = text("walker.xml");
        let names = ["swing", "spread", "twist", "knee", "tip", "roll", "raise", "lift", "turn", "bend"];
        for (index, name) in names.into_iter().enumerate() {
            text = text.replace(&format!("joint name=\"{name}_"), &format!("joint name=\"j{index}_"));
        }
        text
    };
    let plain = text("walker.xml");
    let (ankle, shoulder) = (exchanged("tip", "roll"), exchanged("raise", "lift"));
    for (mjcf, named) in [(&plain, &plain), (&numbered, &plain), (&ankle, &ankle), (&shoulder, &shoulder)] {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let path = folder.path().join("walker.xml");
        std::fs::write(&path, mjcf).expect("a file");
        let draft = RobotDraft::of(&path, "walker.xml").expect("a draft");
        assert_eq!(draft.notes, Vec::<String>::new());
        let drafted = model(mjcf, &draft.text);
        let described = model(named, &text("walker.toml"));
        for (is, wanted) in drafted.joints.iter().zip(&described.joints) {
            assert_eq!((&is.name, is.link), (&wanted.name, wanted.link), "{}", draft.text);
        }
        // The hand points along the forearm, and the camera is in front of the head.
        let hand = &drafted.wrists[Side::Left].link_from_site;
        assert!((hand.rotation * Vector::X - Vector::X).length() < 0.1, "{hand:?}");
        assert!(drafted.egocentric.body_from_camera.translation.x > 0.05);
    }
}

/// Returns the reason why a robot does not stand for a second, or `None` if it does.
#[track_caller]
fn falls(mjcf: &str) -> Option<String> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    std::fs::write(folder.path().join("walker.xml"), mjcf).expect("a file");
    let path = folder.path().join("walker.toml");
    std::fs::write(&path, text("walker.toml")).expect("a file");
    let robot = RobotFile::of(&path).unwrap_or_else(|error| panic!("{error}"));
    check_robot(&robot).expect("a trial").falls
}

/// A robot that is too weak falls, and the error names its joints.
#[test]
fn a_robot_that_cannot_stand_is_found_by_a_second_of_standing() {
    assert_eq!(falls(&text("walker.xml")), None);
    let mut weak = text("walker.xml");
    for effort in ["80 80", "110 110", "70 70", "40 40", "30 30"] {
        weak = weak.replace(&format!("actuatorfrcrange=\"-{effort}\""), "actuatorfrcrange=\"-3 3\"");
    }
    let reason = falls(&weak).expect("it is too weak");
    assert!(reason.contains("left_knee_joint (3 N m)"), "{reason}");
}
