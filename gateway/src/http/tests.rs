//! Test of an episode with diverging physics, over HTTP and at the same time as a normal episode.

use std::{path::Path, sync::Arc};

use serde_json::{Value, json};
use tandem_episodes::{
    Checkpoint, EpisodeSpec, FAILED_STEP_FILE, Recorder, Recording, RobotFile, Session, tasks,
};
use tandem_tools_spec::{EndReason, Protocol};
use tokio::sync::Semaphore;

use super::Server;
use crate::{
    hosting::{EpisodeThread, tests::alone, write_absurd_robot},
    settings::{Layer, Settings},
};

/// Adds a Handover episode to `server` that uses the robots of a file. No caller can request such an episode.
fn hold(server: &Server, id: &str, robot: &Path, folder: &Path) {
    let handover = tasks::find("handover").unwrap();
    let spec = EpisodeSpec {
        robot: RobotFile::of(robot).unwrap(),
        ..EpisodeSpec::new(&handover, 0, Protocol::Benchmark)
    };
    let permit = Arc::new(Semaphore::new(1)).try_acquire_owned().unwrap();
    let started = EpisodeThread::start(id, spec, alone(folder, permit));
    let runtime = tokio::runtime::Builder::new_current_thread().build().unwrap();
    let (episode, _) = runtime.block_on(started).unwrap();
    server.table().insert(id, Arc::new(episode)).unwrap();
}

#[test]
fn physics_that_diverges_ends_its_own_episode_and_says_at_which_body() {
    let place = tempfile::tempdir().unwrap();
    let (robot, folder) = (place.path().join("absurd.xml"), place.path().join("diverging"));
    write_absurd_robot(&robot);
    let flags = Layer {
        listen: Some("127.0.0.1:0".parse().unwrap()),
        runs: Some(place.path().join("runs")),
        ..Layer::default()
    };
    let server = Server::start(Settings::resolve(flags, None).unwrap()).unwrap();
    hold(&server, "diverging", &robot, &folder);
    let agent = ureq::Agent::config_builder().http_status_as_error(false).build().new_agent();
    let post = |path: &str, body: &Value| -> (u16, Value) {
        let url = format!("http://{}/v1/episodes{path}", server.address());
        let mut response = agent.post(url).send_json(body).unwrap();
        (response.status().as_u16(), response.body_mut().read_json().unwrap())
    };
    post("", &json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }));

    let two_steps = json!({ "steps": 2 });
    assert_eq!(post("/diverging/tools/wait", &two_steps).0, 200, "at rest it is sound");
    let reach = json!({ "steps": 5, "robots": [{ "robot": "A", "right_position_m": [0.28, -0.24, 0.22] }] });
    let (status, problem) = post("/diverging/tools/move_wrists", &reach);
    assert_eq!((status, &problem["type"]), (409, &json!("urn:tandem:problem:diverged")), "{problem}");
    let detail = problem["detail"].as_str().unwrap();
    assert!(detail.contains("physics diverged at link") && detail.contains("of `A`"), "{detail}");
    let (status, problem) = post("/diverging/tools/wait", &two_steps);
    assert_eq!(status, 409, "{problem}");
    assert!(problem["detail"].as_str().unwrap().contains("the simulator failed"), "{problem}");
    let state = post("/diverging/tools/get_robot_state", &json!({ "robot": "A" }));
    let recording = Recording::read(&folder.join(Recorder::FILE_NAME)).unwrap();
    let mut last = recording.steps().map(Result::unwrap).last().unwrap();
    assert_eq!((state.0, state.1["time_s"].as_f64()), (200, Some(last.time_s)), "as it was last sound");
    let result = recording.result.unwrap();
    assert_eq!((result.ended, result.tool_calls), (EndReason::SimulatorFailed, 2));
    assert_eq!(u64::from(result.env_steps), last.control_step);
    assert!((2..7).contains(&result.env_steps), "it diverged on the move: {result:?}");

    let failure = result.simulator_failure.unwrap();
    assert!(
        failure.starts_with(&format!("in step {}, physics diverged at link", result.env_steps + 1)),
        "{failure}"
    );
    assert!(detail.contains(&failure), "{detail} {failure}");
    let kept = Checkpoint::read(&folder.join(FAILED_STEP_FILE)).unwrap();
    let failed = kept.failed().unwrap();
    assert_eq!(failed.failure, failure);
    let again = Session::fail_again(&kept, failed).unwrap().unwrap();
    assert!(failure.ends_with(&again.to_string()), "{failure} {again}");
    let mut sound = Session::start(kept.spec(), None).unwrap();
    sound.resume(&kept).unwrap();
    // A checkpoint has no camera poses of the previous step.
    last.robots.iter_mut().for_each(|robot| robot.truth.world_from_camera_before = None);
    assert_eq!((sound.present(), sound.ended()), (&last, None), "the last good step, to go on from");
    assert_eq!(Some(sound.state_hash()), result.state_hash);

    let (status, reply) = post("/handover-seed0/tools/move_wrists", &reach);
    assert_eq!((status, &reply["executed_steps"]), (200, &json!(5)), "{reply}");
    server.stop();
}
