//! Tests of the example tasks in a house, played by the calls of a policy.

use std::path::Path;

use tandem_episodes::{EpisodeError, EpisodeSpec, Session, read_task};
use tandem_tools_spec::{MoveWrists, Protocol, WristMove};

const AHEAD: Option<[f64; 4]> = Some([1.0, 0.0, 0.0, 0.0]);

fn started(task: &str, seed: u32) -> Session {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../gateway/examples/tasks");
    let task = read_task(&folder.join(task)).unwrap_or_else(|error| panic!("{error}"));
    Session::start(&EpisodeSpec::new(&task, seed, Protocol::Benchmark), None).unwrap()
}

/// Moves a wrist of one robot with the fingers ahead. An episode that is over is not changed.
fn reach(session: &mut Session, robot: &str, steps: u32, position_m: [f64; 3]) {
    let hold = WristMove::hold(robot);
    let robot = match robot {
        "A" => WristMove { right_position_m: Some(position_m), right_quaternion_wxyz: AHEAD, ..hold },
        _ => WristMove { left_position_m: Some(position_m), left_quaternion_wxyz: AHEAD, ..hold },
    };
    match session.call(MoveWrists { steps, robots: vec![robot] }.into()) {
        Ok(_) | Err(EpisodeError::Ended { .. }) => {}
        Err(error) => panic!("{error}"),
    }
}

/// A pushes the drawer open from behind its front, B the tin over the edge, and the spring closes the drawer.
#[test]
fn two_robots_put_a_tin_into_a_drawer() {
    let mut session = started("into_the_drawer.toml", 2000);
    for (steps, at_m) in [(40, [0.1, -0.26, 0.22]), (30, [0.18, -0.26, 0.22]), (30, [0.18, -0.26, 0.07])] {
        reach(&mut session, "A", steps, at_m);
    }
    reach(&mut session, "A", 50, [0.18, 0.0, 0.07]);
    let facts = session.facts();
    let opened_m = facts.opened("kitchen_chest_0_drawer");
    let moved_m = -facts.position_m("kitchen_chest_0_drawer").x;
    assert!(opened_m > 0.14 && (opened_m - moved_m).abs() < 1e-4, "{opened_m} m, {moved_m} m");
    for (steps, at_m) in [(40, [0.1, 0.3, 0.22]), (30, [0.2, 0.3, 0.22]), (30, [0.2, 0.3, 0.07])] {
        reach(&mut session, "B", steps, at_m);
    }
    reach(&mut session, "B", 50, [0.2, -0.02, 0.07]);
    reach(&mut session, "B", 40, [0.1, 0.2, 0.22]);
    reach(&mut session, "A", 50, [0.18, -0.26, 0.07]);
    reach(&mut session, "A", 30, [0.1, -0.26, 0.22]);
    let result = session.close();
    assert_eq!((result.success, result.falls), (Some(true), 0), "{result:?}");
    let reached = ["p1", "p2", "p3"].map(|phase| result.phases.reached_s(phase).is_some());
    assert_eq!(reached, [true; 3], "{:?}", result.phases);
}
