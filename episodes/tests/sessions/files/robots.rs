//! Episodes with robots of somebody's own.

use std::path::{Path, PathBuf};

use tandem_episodes::{EpisodeError, EpisodeSpec, RobotError, RobotFile, Session, tandem_plus, tasks};
use tandem_tools_spec::{MoveWrists, Protocol, WristMove};

use crate::common::command;

fn walker() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/examples/robots/walker.toml")
}

fn spec(task: &str) -> EpisodeSpec {
    let task = tasks::ALL.iter().chain(tandem_plus().iter().copied()).find(|known| known.id == task);
    let robot = RobotFile::of(&walker()).expect("a robot");
    EpisodeSpec { robot, ..EpisodeSpec::new(task.expect("a task"), 0, Protocol::Benchmark) }
}

/// With arms of four joints a hand gets to a place, though not any way round.
#[test]
fn a_described_robot_reaches_and_results_name_it() {
    let spec = spec("swap");
    assert!(spec.departures().contains(&"robot: walker".into()), "{:?}", spec.departures());
    let mut session = Session::start(&spec, None).expect("an episode");
    let began_m = session.present().robots[0].sensed.pelvis_from_wrist.left.translation;
    let wanted_m = [0.03, 0.02, 0.06].map(f64::from);
    let target_m: [f64; 3] = std::array::from_fn(|i| f64::from(began_m[i]) + wanted_m[i]);
    for _ in 0..2 {
        let reach = WristMove { left_position_m: Some(target_m), ..WristMove::hold("A") };
        command(&mut session, MoveWrists { steps: 50, robots: vec![reach] }.into());
    }
    let robot = &session.present().robots[0];
    let reached_m = robot.sensed.pelvis_from_wrist.left.translation;
    let missing_m = (0..3).map(|i| (f64::from(reached_m[i]) - target_m[i]).powi(2)).sum::<f64>().sqrt();
    assert!(!robot.truth.fallen && missing_m < 0.03, "{missing_m} m from {target_m:?} at {reached_m}");
}

#[test]
fn a_task_that_needs_fingers_is_refused_with_tasks_that_do_not() {
    let error = Session::start(&spec("handover"), None).map(|_| ()).expect_err("no fingers");
    assert!(matches!(error, EpisodeError::Robot(_)), "{error:?}");
    let text = error.to_string();
    assert!(text.contains("handover needs hands that close") && text.contains("swap"), "{text}");
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
