//! Tests of episodes with users' robots.

use std::path::{Path, PathBuf};

use tandem_episodes::{
    EpisodeError, EpisodeSpec, RobotError, RobotFile, Session, read_task,
    tasks::{self, Task},
};
use tandem_tools_spec::{CheckReach, LookReply, MoveWrists, Protocol, ToolReply, WristMove};

use crate::common::command;

fn walker() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/examples/robots/walker.toml")
}

fn spec(task: &Task) -> EpisodeSpec {
    let robot = RobotFile::of(&walker()).expect("a robot");
    EpisodeSpec { robot, ..EpisodeSpec::new(task, 0, Protocol::Benchmark) }
}

fn parcel() -> Task {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../gateway/examples/tasks/pass_the_parcel.toml");
    read_task(Path::new(path)).expect("a task")
}

/// With an arm of four joints a hand reaches a position, in whatever orientation these joints allow.
#[test]
fn a_described_robot_reaches_and_results_name_it() {
    let spec = spec(&parcel());
    assert!(spec.departures().contains(&"robot: walker".into()), "{:?}", spec.departures());
    let mut session = Session::start(&spec, None).expect("an episode");
    let began_m = session.present().robots[0].sensed.pelvis_from_wrist.left.translation;
    let from_there = |by_m: [f64; 3]| std::array::from_fn(|axis| f64::from(began_m[axis]) + by_m[axis]);
    for by_m in [[0.05, 0.03, 0.08], [0.02, 0.10, 0.02], [0.08, -0.03, 0.10]] {
        let target_m: [f64; 3] = from_there(by_m);
        let asked = CheckReach {
            robot: "A".into(),
            left_position_m: Some(target_m),
            left_quaternion_wxyz: None,
            right_position_m: None,
            right_quaternion_wxyz: None,
            frame: None,
            keep_waist: None,
        };
        let ToolReply::Look(LookReply::CheckReach(reach)) = session.call(asked.into()).expect("an answer")
        else {
            panic!("a reply about reach")
        };
        assert!(reach.reachable, "{by_m:?}: {reach:?}");
        let reach = WristMove { left_position_m: Some(target_m), ..WristMove::hold("A") };
        for _ in 0..2 {
            command(&mut session, MoveWrists { steps: 50, robots: vec![reach.clone()] }.into());
        }
        let robot = &session.present().robots[0];
        let reached_m = robot.sensed.pelvis_from_wrist.left.translation;
        let off_m = |axis: usize| f64::from(reached_m[axis]) - target_m[axis];
        let missing_m = (0..3).map(|axis| off_m(axis).powi(2)).sum::<f64>().sqrt();
        assert!(!robot.truth.fallen && missing_m < 0.01, "{missing_m} m from {target_m:?} at {reached_m}");
    }
}

#[test]
fn tasks_that_need_fingers_are_refused_with_one_that_does_not() {
    for task in tasks::cohub().iter().chain(tasks::tandem_plus()) {
        let error = Session::start(&spec(task), None).map(|_| ()).expect_err("no fingers");
        assert!(matches!(error, EpisodeError::Robot(_)), "{error:?}");
        let text = error.to_string();
        assert!(text.starts_with(&format!("{} needs hands that close", task.id)), "{text}");
        assert!(text.contains("pass_the_parcel.toml"), "{text}");
    }
}

#[test]
fn a_robot_that_has_changed_is_not_played_on() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    for extension in ["xml", "toml"] {
        let from = walker().with_extension(extension);
        std::fs::copy(&from, folder.path().join(from.file_name().expect("a name"))).expect("a copy");
    }
    let path = folder.path().join("walker.toml");
    let robot = RobotFile::of(&path).expect("a robot");
    robot.load().expect("it is as it was");
    let mjcf = std::fs::read_to_string(path.with_extension("xml")).expect("the MJCF");
    std::fs::write(path.with_extension("xml"), mjcf.replace("mass=\"7\"", "mass=\"8\"")).expect("a change");
    assert!(matches!(robot.load(), Err(RobotError::Changed { .. })));
}
