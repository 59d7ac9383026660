//! Tests of learned policies on working servers: the observations that they receive, and the execution of
//! their responses by the robots.

use std::{collections::BTreeMap, fs, path::Path, sync::Mutex};

use rmpv::Value;
use serde_json::json;
use tandem_policies::{PolicyMap, PolicyProtocol, RemotePolicy};
use tandem_tools_spec::EndReason;

use super::{
    act_server::ActServer,
    openpi_server::{Decide, OpenpiServer, Reply, entry, floats},
    plans::{last_angles_rad, plan, play},
};

/// Indices of the wrists' last joints among the 43 joints of a state.
const LEFT_WRIST: usize = 21;
const RIGHT_WRIST: usize = 35;
/// Words that occur only in A's instruction.
const WORDS_OF_A: &str = "Take the bottle";
/// Indices of the same joints in an action row.
pub const LEFT_WRIST_COLUMN: usize = 6;
const RIGHT_WRIST_COLUMN: usize = 13;

/// Reads a policy map from a file with this text.
pub fn map(folder: &Path, text: &str) -> PolicyMap {
    let path = folder.join("map.toml");
    fs::write(&path, text).expect("a file");
    PolicyMap::find(&path.display().to_string()).expect("a map")
}

/// Returns a policy that keeps every robot at its first measured state, except for one wrist joint. The
/// function `wrist` maps the instruction to the joint's column and angle.
pub fn turning(wrist: impl Fn(&str) -> (usize, f32) + Send + Sync + 'static, rows: usize) -> Box<Decide> {
    // Robots are distinguished by their instructions.
    let first: Mutex<BTreeMap<String, Vec<f32>>> = Mutex::default();
    Box::new(move |number, request| {
        let state = floats(request, "observation/state");
        let words = entry(request, "prompt").as_str().expect("a text");
        let mut first = first.lock().expect("no panic");
        // The first request is a trial that belongs to no robot.
        let state = if number == 0 { state } else { first.entry(words.into()).or_insert(state).clone() };
        let groups = [15..22, 29..36, 22..29, 36..43, 12..15];
        let mut row: Vec<f32> = groups.into_iter().flat_map(|group| state[group].to_vec()).collect();
        row.extend([0.0, 0.0, 0.0, 0.74]);
        let (column, target_rad) = wrist(words);
        row[column] = target_rad;
        Reply::Rows(vec![row; rows])
    })
}

#[test]
fn an_openpi_policy_sees_feels_and_turns_wrists() {
    // A shared policy that recognises the robot from its instruction.
    let server = OpenpiServer::start(|_| {
        turning(
            |words| {
                if words.contains(WORDS_OF_A) { (LEFT_WRIST_COLUMN, 0.3) } else { (RIGHT_WRIST_COLUMN, 0.5) }
            },
            50,
        )
    });
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policy = RemotePolicy::new(
        PolicyProtocol::Openpi,
        vec![server.url()],
        PolicyMap::find("openpi").expect("a preset"),
    );
    let evaluation = play(&plan(&policy, vec![1], true), folder.path());
    let [played] = &evaluation.episodes[..] else { panic!("{evaluation:?}") };
    assert_eq!((played.result.ended, played.result.env_steps), (EndReason::StepBudgetExhausted, 1000));
    // Twenty observations, each followed by a command.
    assert_eq!(played.result.tool_calls, 40);
    assert_eq!(
        (&*played.policy.name, played.policy.extra_information.len()),
        (&*format!("openpi:{}", server.url()), 0)
    );
    let near = |joint: usize, robot: usize, target_rad: f32| {
        let angle_rad = last_angles_rad(folder.path(), "handover-1", joint)[robot];
        assert!((angle_rad - target_rad).abs() < 0.03, "{joint} of {robot}: {angle_rad}");
    };
    near(LEFT_WRIST, 0, 0.3);
    near(RIGHT_WRIST, 1, 0.5);

    // One trial with black images, then twenty requests for each robot. A's measured wrist turns meanwhile.
    let requests = server.requests.lock().expect("no panic");
    assert_eq!(requests.len(), 41);
    let bright = |request: &Value| {
        let picture = entry(request, "observation/image");
        assert_eq!(entry(picture, "shape").to_string(), "[224, 224, 3]");
        entry(picture, "data").as_slice().expect("bytes").iter().filter(|byte| **byte > 60).count()
    };
    assert_eq!(bright(&requests[0]), 0);
    assert!(bright(&requests[1]) > 20_000 && bright(&requests[2]) > 20_000);
    assert_ne!(entry(&requests[1], "observation/image"), entry(&requests[2], "observation/image"));
    let wrists_rad: Vec<f32> = requests
        .iter()
        .skip(1)
        .step_by(2)
        .map(|request| floats(request, "observation/state")[LEFT_WRIST])
        .collect();
    assert!((wrists_rad[0] - 0.3).abs() > 0.2 && (wrists_rad[3] - 0.3).abs() < 0.03, "{wrists_rad:?}");
}

#[test]
fn each_robot_may_have_a_policy_of_its_own() {
    let of_own =
        |target_rad: f32| OpenpiServer::start(move |_| turning(move |_| (LEFT_WRIST_COLUMN, target_rad), 25));
    let servers = [of_own(0.2), of_own(0.6)];
    let urls = servers.iter().map(OpenpiServer::url).collect();
    let folder = tempfile::tempdir().expect("a temporary folder");
    let first_twenty = map(folder.path(), "preset = \"openpi\"\n[chunk]\nrows = 25\nexecute = 20\n");
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, urls, first_twenty.clone());
    let evaluation = play(&plan(&policy, vec![1], true), folder.path());
    assert_eq!(evaluation.episodes[0].result.tool_calls, 100, "50 times 20 steps");
    let wrists_rad = last_angles_rad(folder.path(), "handover-1", LEFT_WRIST);
    assert!((wrists_rad[0] - 0.2).abs() < 0.03 && (wrists_rad[1] - 0.6).abs() < 0.03, "{wrists_rad:?}");
    assert!(servers.iter().all(|server| server.requests.lock().expect("no panic").len() == 51));

    let three = RemotePolicy::new(PolicyProtocol::Openpi, vec![servers[0].url(); 3], first_twenty);
    let elsewhere = tempfile::tempdir().expect("a temporary folder");
    let evaluation = play(&plan(&three, vec![2], false), elsewhere.path());
    assert_eq!(
        evaluation.left_out,
        ["handover seed 2: 3 servers for 2 robots; give one for all, or one for each"]
    );
}

/// Policy map of a policy that directs both robots and receives images from the camera in the room.
const CENTRAL: &str = r#"
preset = "openpi"
scope = "global"
answer = "all"
instruction = "joint"
[images]
"observation > {robot}" = { camera = "egocentric", size = [64, 48] }
"observation > room" = { camera = "third_person", size = [64, 48] }
[state]
"observation > wrist_{robot}" = ["left_wrist_yaw_joint"]
[prompt]
"observation > words" = "list"
[action]
"" = ["left_wrist_yaw_joint", "pelvis_height_m"]
"#;

#[test]
fn one_policy_behind_act_may_direct_all_and_see_the_room() {
    let server = ActServer::start(|_| (200, json!(vec![[0.2, 0.74, 0.6, 0.74]; 50])));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let central = map(folder.path(), CENTRAL);
    let policy = RemotePolicy::new(PolicyProtocol::Act, vec![server.url()], central.clone());
    let evaluation = play(&plan(&policy, vec![1], true), folder.path());
    let played = &evaluation.episodes[0];
    assert_eq!(played.policy.extra_information, ["third_person"]);
    assert_eq!(played.policy.settings, Some(json!(central)));
    let text = fs::read_to_string(folder.path().join("results.json")).expect("results");
    let results: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(results["extra_information"], json!(["third_person"]));
    assert_eq!(results["episodes"][0]["policy_settings"]["answer"], "all");
    let wrists_rad = last_angles_rad(folder.path(), "handover-1", LEFT_WRIST);
    assert!((wrists_rad[0] - 0.2).abs() < 0.03 && (wrists_rad[1] - 0.6).abs() < 0.03, "{wrists_rad:?}");

    let requests = server.requests.lock().expect("no panic");
    assert_eq!(requests.len(), 21);
    let asked = requests[1]["observation"].as_object().expect("an object");
    let keys: Vec<&str> = asked.keys().map(String::as_str).collect();
    assert_eq!(keys, ["room", "A", "B", "wrist_A", "wrist_B", "words"]);
    assert_eq!((&asked["room"]["shape"], &asked["A"]["dtype"]), (&json!([48, 64, 3]), &json!("|u1")));
    assert_eq!((&asked["wrist_B"]["shape"], &asked["wrist_B"]["dtype"]), (&json!([1]), &json!("<f4")));
    assert!(
        asked["A"]["__numpy__"] != asked["B"]["__numpy__"]
            && asked["A"]["__numpy__"] != asked["room"]["__numpy__"]
    );
}
