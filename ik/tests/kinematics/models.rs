//! Models from both formats agree with each other and with Pinocchio's poses; bad names and numbers are
//! reported.

use serde_json::Value;
use tandem_ik::{Configuration, Model, bench::TargetSet};

use super::common;

const TARGETS: &str = include_str!("../data/wrist_targets.json");
const URDF: &str = include_str!("../data/g1_upper_body.urdf");

/// Tolerance on poses: the files round lengths to about 1e-7 m.
const POSE_TOLERANCE: f64 = 2e-6;

#[test]
fn both_formats_put_the_wrists_where_pinocchio_does() {
    let set = TargetSet::from_json(TARGETS).expect("valid targets");
    let file: Value = serde_json::from_str(TARGETS).expect("valid JSON");
    let witness = |target: &Value| -> Vec<f64> {
        target["witness_q_rad"].as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
    };
    let witnesses: Vec<Vec<f64>> = file["targets"].as_array().into_iter().flatten().map(witness).collect();
    for whole in [Model::from_mjcf(common::ROBOT), Model::from_urdf(URDF)] {
        let model = set.reduce(&whole.expect("a valid file")).expect("the same joints");
        for (target, q) in set.targets.iter().zip(&witnesses) {
            let configuration = Configuration::new(&model, q).expect("17 numbers");
            for (name, pose) in &target.frames {
                let ours = configuration.root_from_frame(model.frame(name).expect("a link"));
                let off = ours.inverse() * pose.isometry();
                assert!(off.translation.vector.norm() < POSE_TOLERANCE, "{name}: {off}");
                assert!(off.rotation.angle() < POSE_TOLERANCE, "{name}: {off}");
            }
        }
    }
}

#[test]
fn locking_joints_moves_nothing() {
    let whole = Model::from_mjcf(common::ROBOT).expect("the robot's file");
    let bent: Vec<f64> = (0..whole.nv()).map(|joint| 0.1 * (joint as f64).sin()).collect();
    let free = ["waist_yaw_joint", "left_elbow_joint", "left_wrist_yaw_joint"];
    let reduced = whole.reduced(&free, &bent).expect("joints of the robot");
    let q: Vec<f64> =
        reduced.joints().iter().map(|joint| bent[whole.joint(&joint.name).expect("known")]).collect();
    let before = Configuration::new(&whole, &bent).expect("all joints");
    let after = Configuration::new(&reduced, &q).expect("three joints");
    for frame in whole.frames().iter().filter(|frame| !frame.name.is_empty()) {
        let pose = |configuration: &Configuration| {
            configuration.root_from_frame(configuration.model().frame(&frame.name).expect("kept"))
        };
        let off = pose(&before).inverse() * pose(&after);
        assert!(off.translation.vector.norm() + off.rotation.angle() < 1e-12, "{} moves", frame.name);
    }
    assert!((before.center_of_mass() - after.center_of_mass()).norm() < 1e-12);
}

#[test]
fn messages_name_what_there_is() {
    let model = common::g1();
    let check = |text: String, expected: &str| assert!(text.contains(expected), "{text}");
    check(model.frame("left_wrst").expect_err("misspelt").to_string(), "left_wrist");
    check(model.joint("elbow").expect_err("misspelt").to_string(), "left_elbow_joint");
    check(
        Configuration::new(&model, &[0.0; 3]).expect_err("too few").to_string(),
        "3 joint coordinates given",
    );
    check(Configuration::new(&model, &[f64::NAN; 17]).expect_err("no numbers").to_string(), "not finite");
    let ball =
        r#"<mujoco><worldbody><body name="a"><joint type="ball" name="b"/></body></worldbody></mujoco>"#;
    check(Model::from_mjcf(ball).expect_err("a ball joint").to_string(), "use hinges and slides");
    let refused = |body: &str, expected: &str| {
        let xml = format!("<mujoco><worldbody><body name=\"a\">{body}</body></worldbody></mujoco>");
        check(Model::from_mjcf(&xml).expect_err(expected).to_string(), expected);
    };
    refused(r#"<joint name="h" ref="10"/>"#, "joint `h`: `ref` is not read");
    refused(r#"<joint name="h" axis="0 0 0"/>"#, "joint `h`: its axis is 0 0 0");
    refused(r#"<joint name="h" limited="true"/>"#, "joint `h`: it is limited without a range");
    refused(r#"<joint name="h" pos="nan 0 0"/>"#, "joint `h`: its place");
    refused(r#"<body name="b"><freejoint/></body>"#, "it is Free; use hinges and slides");
    refused(r#"<body name="a"/>"#, "body `a`: there is another of this name");
    refused(r#"<body><inertial pos="0 0 0" mass="-1"/></body>"#, "body without a name: its mass is below 0");
    refused(&("<body>".repeat(20_000) + &"</body>".repeat(20_000)), "nest fewer");
    check(Model::from_urdf("<robot").expect_err("cut off").to_string(), "not valid URDF");
}

#[test]
fn sampled_targets_are_reachable_and_repeat() {
    let model = common::g1();
    let sample = |seed| {
        let frames = ["left_wrist", "right_wrist"];
        TargetSet::sample(&model, &frames, &common::READY_RAD, 20, seed).expect("sites of the robot")
    };
    let text = |set: &TargetSet| format!("{:?}", set.targets);
    assert_eq!(text(&sample(7)), text(&sample(7)));
    assert_ne!(text(&sample(7)), text(&sample(8)));
    let report = tandem_ik::bench::run(&model, &sample(7)).expect("the same model");
    let last = report.configurations.last().expect("four ways");
    assert!(last.reached >= 0.95, "{last:?}");
}
