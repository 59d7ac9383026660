//! Tests of learned policies with outputs other than joint rows at 50 Hz: wrist poses, differences from the
//! measured state, and rows at another rate. Other tests have policies that observe more than one time step.
//! All outputs reach the episode as calls that can be replayed.

use std::path::Path;

use serde_json::Value;
use tandem_episodes::{
    Recorder, Recording,
    replay::{Verdict, verify},
};
use tandem_evaluation::results::PlayedEpisode;
use tandem_policies::{PolicyProtocol, RemotePolicy};
use tandem_tools_spec::EndReason;

use super::{
    openpi_server::{OpenpiServer, Reply, entry, floats},
    plans::{plan, play},
    servers::map,
};

/// Outcome of an episode, and the requests for robot A.
struct Played {
    episode: PlayedEpisode,
    recording: Recording,
    /// Requests for robot A, without the trial request before the episode.
    asked: Vec<rmpv::Value>,
}

/// Plays Handover with a policy that answers requests with `rows`, and verifies the recording.
fn played(
    map_text: &str,
    rows: impl Fn(&rmpv::Value) -> Vec<Vec<f32>> + Send + Sync + Copy + 'static,
) -> Played {
    let server = OpenpiServer::start(move |_| Box::new(move |_, request| Reply::Rows(rows(request))));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let map = map(folder.path(), &format!("preset = \"openpi\"\n[images]\n{map_text}"));
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, vec![server.url()], map);
    let mut evaluation = play(&plan(&policy, vec![2000], true), folder.path());
    assert_eq!(evaluation.left_out, [""; 0]);
    let episode = evaluation.episodes.remove(0);
    assert_eq!(
        (episode.result.ended, episode.result.env_steps),
        (EndReason::StepBudgetExhausted, 1000),
        "{:?}",
        episode.note
    );
    let recording = recording(folder.path());
    assert_eq!(verify(&recording).expect("it is simulated again").outcome, Verdict::Same);
    let requests = server.requests.lock().expect("no panic");
    let asked = requests.iter().skip(1).step_by(2).cloned().collect();
    Played { episode, recording, asked }
}

fn recording(folder: &Path) -> Recording {
    let path = folder.join("episodes/handover-2000").join(Recorder::FILE_NAME);
    Recording::read(&path).expect("a recording")
}

impl Played {
    /// Returns the arguments of the recorded calls of one tool.
    fn calls(&self, tool: &str) -> Vec<Value> {
        let calls = self.recording.tool_calls().expect("calls");
        calls.into_iter().filter(|call| call.tool == tool).map(|call| call.arguments).collect()
    }

    /// Returns the angle of one of A's joints at a control step.
    fn angle_rad(&self, joint: usize, control_step: u64) -> f32 {
        let mut steps = self.recording.steps().map(|step| step.expect("a whole step"));
        let step = steps.find(|step| step.control_step == control_step).expect("a step");
        step.robots[0].sensed.joints.q_rad[joint]
    }
}

/// Target position in front of the robot.
const GOAL_M: [f32; 3] = [0.32, -0.22, 0.14];
/// Orientation in which the right palm, which faces left at first, is turned down.
const PALM_DOWN_ROWS: [f32; 6] = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
const CLOSED: [f32; 7] = [0.0, -0.75, -0.8, 1.1, 1.3, 1.1, 1.3];

const WRIST: &str = r#"
[state]
"wrist" = ["right_wrist_position", "right_wrist_rows_6d"]
[action]
"actions" = ["right_wrist_position", "right_wrist_rows_6d", "right_hand", "pelvis_height_m"]
[chunk]
rate_hz = 10
"#;

#[test]
fn a_policy_may_tell_where_wrists_are_to_be() {
    let played = played(WRIST, |request| {
        let wrist = floats(request, "wrist");
        // Moves straight to the goal, by 3 cm per row.
        let way: Vec<f32> = GOAL_M.iter().zip(&wrist).map(|(goal, at)| goal - at).collect();
        let length_m = way.iter().map(|part| part * part).sum::<f32>().sqrt().max(1e-6);
        let row = |number: u8| {
            let share = (0.03 * f32::from(number) / length_m).min(1.0);
            let position = wrist.iter().zip(&way).map(|(at, way)| at + share * way).collect::<Vec<_>>();
            [&position[..], &PALM_DOWN_ROWS, &CLOSED, &[0.74]].concat()
        };
        (1..=10).map(row).collect()
    });
    // Twenty observations, each followed by ten rows of five control steps.
    assert_eq!(played.episode.result.tool_calls, 20 + 200);
    let calls = played.calls("move_wrists");
    assert_eq!((calls.len(), &calls[0]["steps"]), (200, &5.into()));
    assert_eq!(
        (&calls[0]["robots"][0]["carried"], &calls[0]["robots"][0]["left_position_m"]),
        (&true.into(), &Value::Null)
    );
    for seen in [10, 19] {
        let wrist = floats(&played.asked[seen], "wrist");
        let off_m = GOAL_M.iter().zip(&wrist).map(|(goal, at)| (goal - at).powi(2)).sum::<f32>().sqrt();
        let turned = PALM_DOWN_ROWS.iter().zip(&wrist[3..]).all(|(goal, at)| (goal - at).abs() < 0.1);
        assert!(off_m < 0.02 && turned, "{off_m} m, {wrist:?}");
    }
    // The fingers have closed. The other arm, which no key commands, has kept its joint angles.
    assert!((played.angle_rad(41, 1000) - CLOSED[5]).abs() < 0.2, "{}", played.angle_rad(41, 1000));
    assert!((played.angle_rad(18, 1000) - played.angle_rad(18, 1)).abs() < 0.03);
}

const NUDGE: &str = r#"
[state]
"state" = ["left_wrist_yaw_joint"]
[action]
"actions" = ["left_wrist_yaw_joint"]
[chunk]
rows = 15
rate_hz = 15
delta = ["left_wrist_yaw_joint"]
"#;
/// Index of the left wrist yaw joint among the columns of a row; `WRIST_JOINT` is its index in a state.
const WRIST_COLUMN: usize = 6;
const WRIST_JOINT: usize = 21;

#[test]
fn a_policy_may_tell_differences_at_its_own_rate() {
    let rows = |request: &rmpv::Value| {
        let way = 0.9 - floats(request, "state")[0];
        (1..=15u8).map(|row| vec![way.clamp(-0.02 * f32::from(row), 0.02 * f32::from(row))]).collect()
    };
    let interpolated = played(NUDGE, rows);
    assert_eq!(interpolated.episode.result.tool_calls, 40, "a second, fifty control steps, is one command");
    let last_rad = interpolated.angle_rad(WRIST_JOINT, 1000);
    assert!((last_rad - 0.9).abs() < 0.03, "{last_rad}");
    // Fifteen rows are spread evenly over fifty control steps. The first row's target is the measured angle
    // plus 0.02 rad, reached in steps of 20 ms.
    let targets = |played: &Played| -> Vec<f64> {
        let calls = played.calls("send_joint_chunk");
        let rows = calls[1]["robots"][0]["rows"].as_array().expect("rows");
        rows.iter().map(|row| row[WRIST_COLUMN].as_f64().expect("a number")).collect()
    };
    let sensed = f64::from(floats(&interpolated.asked[1], "state")[0]);
    let told = targets(&interpolated);
    assert_eq!(told.len(), 50);
    assert!((told[2] - sensed - 0.02).abs() < 1e-6 && (told[6] - sensed - 0.04).abs() < 1e-6, "{told:?}");
    assert!((told[1] - told[0] - (told[2] - told[1])).abs() < 1e-9, "even steps: {told:?}");

    let held = played(&format!("{NUDGE}between = \"hold\"\n"), rows);
    let sensed = f64::from(floats(&held.asked[1], "state")[0]);
    let told = targets(&held);
    assert!(told[..3].iter().all(|rad| (rad - sensed - 0.02).abs() < 1e-6), "{told:?}");
    assert!(told[3..7].iter().all(|rad| (rad - sensed - 0.04).abs() < 1e-6), "{told:?}");
}

const SWING: &str = r#"
"image" = { camera = "egocentric", size = [96, 96], fit = "crop", layout = "chw" }
[state]
"state" = ["left_wrist_yaw_joint"]
[action]
"actions" = ["left_wrist_yaw_joint"]
[chunk]
rows = 16
execute = 8
rate_hz = 10
[history]
length = 2
stride = 1
"#;

#[test]
fn a_policy_may_see_two_moments() {
    let played = played(SWING, |request| {
        // Continues at the observed speed, slightly faster at first, and turns back at the ends.
        let [before, now] = floats(request, "state")[..] else { panic!("two moments") };
        let way = if now > 0.5 || now > -0.5 && now < before { -0.05 } else { 0.05 };
        (1..=16u8).map(|row| vec![now + way * f32::from(row)]).collect()
    });
    // One observation is made at each request, and another one row (five control steps) before the next
    // request.
    assert_eq!(played.asked.len(), 25);
    assert_eq!(played.calls("observe").len(), 25 + 25);
    assert_eq!(
        floats(&played.asked[0], "state")[0],
        floats(&played.asked[0], "state")[1],
        "nothing was before"
    );
    for (number, request) in (0u64..).zip(&played.asked).skip(1) {
        let shape = entry(entry(request, "image"), "shape").to_string();
        assert_eq!(shape, "[2, 3, 96, 96]");
        let seen = floats(request, "state");
        let sensed = [40 * number - 5, 40 * number].map(|step| played.angle_rad(WRIST_JOINT, step));
        assert!(
            seen.iter().zip(sensed).all(|(seen, sensed)| (seen - sensed).abs() < 1e-5),
            "{seen:?}, {sensed:?}"
        );
        let pictures = entry(entry(request, "image"), "data").as_slice().expect("bytes");
        let (before, now) = pictures.split_at(pictures.len() / 2);
        assert_ne!(before, now);
    }
}
