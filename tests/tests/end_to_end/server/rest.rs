//! Tests of episodes over REST: their life cycle from start to recording, and which calls interrupt others.

use std::{
    io::Write,
    net::TcpStream,
    thread::sleep,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tandem_tests::TestServer;
use tandem_tools_spec::Hints;

#[test]
fn an_episode_lives_from_start_to_recording() {
    let server = TestServer::start();
    let answer =
        server.post("/v1/episodes", &json!({ "task": "handover", "seed": 3, "protocol": "benchmark" }));
    assert_eq!((answer.status, answer.header("location")), (201, "/v1/episodes/handover-seed3"));
    let started = answer.ok();
    assert_eq!(started["robots"].as_array().map(Vec::len), Some(2));
    assert_eq!(started["kinds"][0]["joints"].as_array().map(Vec::len), Some(43));
    assert_eq!(started["action_row"].as_array().map(Vec::len), Some(35));

    let id = started["episode_id"].as_str().expect("an id");
    let reply = server.tool(id, "wait", &json!({ "steps": 10, "episode_id": id })).ok();
    assert_eq!((&reply["executed_steps"], &reply["stop_reason"]), (&json!(10), &json!("steps_done")));
    let status = server.get(&format!("/v1/episodes/{id}")).ok();
    assert_eq!(
        (&status["seed"], &status["env_steps"], &status["ended"]),
        (&json!(3), &json!(10), &Value::Null)
    );

    let view = server.tool(id, "observe", &json!({})).ok();
    let png = view["images"][1]["png_base64"].as_str().expect("a picture");
    assert!(png.starts_with("iVBORw0KGgo") && png.len() > 5_000, "{} characters", png.len());
    assert_eq!(view["cameras"][1]["width"], 320);

    let result = server.delete(&format!("/v1/episodes/{id}")).ok();
    assert_eq!((&result["env_steps"], &result["state_hash"]), (&json!(10), &status["state_hash"]));
    server.get(&format!("/v1/episodes/{id}")).refused(404, &["handover-seed3"]);
    for file in ["episode.mcap", "result.json"] {
        let bytes = std::fs::metadata(server.folder(id).join(file)).map(|data| data.len());
        assert!(bytes.as_ref().is_ok_and(|bytes| *bytes > 100), "{file}: {bytes:?}");
    }
}

#[test]
fn physics_stands_still_between_calls() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    server.tool(&id, "wait", &json!({ "steps": 5 })).ok();
    let look = || {
        let state = server.tool(&id, "get_robot_state", &json!({ "robot": "B" })).ok();
        (state, server.tool(&id, "get_status", &json!({})).ok()["state_hash"].clone())
    };
    let before = look();
    sleep(Duration::from_millis(300));
    assert_eq!(look(), before);
}

#[test]
fn the_same_calls_give_the_same_state() {
    let server = TestServer::start();
    let play = || {
        let id = server.episode("benchmark");
        let moved =
            json!({ "steps": 20, "robots": [{ "robot": "A", "right_position_m": [0.3, -0.2, 0.15] }] });
        server.tool(&id, "move_wrists", &moved).ok();
        server.tool(&id, "observe", &json!({})).ok();
        server.delete(&format!("/v1/episodes/{id}")).ok()["state_hash"].clone()
    };
    assert_eq!(play(), play());
}

#[test]
fn places_are_limited_and_an_ended_episode_makes_room() {
    let server = TestServer::start();
    let (first, _second) = (server.episode("benchmark"), server.episode("benchmark"));
    let third =
        || server.post("/v1/episodes", &json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }));
    let refused = third();
    refused.refused(429, &["all 2 places", "DELETE"]);
    assert_eq!(refused.header("retry-after"), "10");
    server.tool(&first, "finish", &json!({})).ok();
    assert_eq!(third().status, 201);
    server.get(&format!("/v1/episodes/{first}")).refused(404, &[]);
    assert_eq!(server.get("/healthz").ok()["episodes"], 2);
}

/// Sends a request without waiting for the response.
fn send_only(server: &TestServer, id: &str, tool: &str, args: &Value) -> TcpStream {
    let body = args.to_string();
    let mut stream = TcpStream::connect(server.address).expect("a connection");
    write!(
        stream,
        "POST /v1/episodes/{id}/tools/{tool} HTTP/1.1\r\nhost: localhost\r\ncontent-type: application/json\r\ncontent-length: {}\r\n\r\n{body}",
        body.len()
    )
    .expect("a request");
    stream
}

#[test]
fn a_call_whose_client_has_gone_still_finishes() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let stream = send_only(&server, &id, "wait", &json!({ "steps": 50 }));
    sleep(Duration::from_millis(50));
    drop(stream);
    let env_steps = || server.tool(&id, "get_status", &json!({})).ok()["env_steps"].clone();
    let deadline = Instant::now() + Duration::from_secs(20);
    while env_steps() != 50 {
        assert!(Instant::now() < deadline, "the abandoned call was not finished: {} steps", env_steps());
    }
}

#[test]
fn stopping_finishes_the_call_under_way_and_closes_recordings() {
    let mut server = TestServer::start();
    let id = server.episode("benchmark");
    let _stream = send_only(&server, &id, "wait", &json!({ "steps": 50 }));
    sleep(Duration::from_millis(50));
    server.stop();
    let folder = server.folder(&id);
    let result = std::fs::read_to_string(folder.join("result.json")).expect("result.json");
    let result: Value = serde_json::from_str(&result).expect("JSON");
    assert_eq!(result["env_steps"], 50, "{result}");
    assert!(folder.join("episode.mcap").exists());
}

#[test]
fn tools_and_tasks_are_listed() {
    let server = TestServer::start();
    let tools = server.get("/v1/tools").ok();
    let names: Vec<&str> =
        tools.as_array().into_iter().flatten().filter_map(|tool| tool["name"].as_str()).collect();
    let specs = tandem_tools_spec::tool_specs(Hints::On);
    assert_eq!(names, specs.iter().map(|spec| spec.name).collect::<Vec<_>>());
    let tasks = server.get("/v1/tasks").ok();
    let handover = tasks["tasks"].as_array().into_iter().flatten().find(|task| task["id"] == "handover");
    assert_eq!(handover.and_then(|task| task["phases"].as_array()).map(Vec::len), Some(3), "{tasks}");

    // The limits are available before the first episode, and are the same for each robot of an episode.
    let started =
        server.post("/v1/episodes", &json!({ "task": "handover", "seed": 0, "protocol": "benchmark" })).ok();
    for field in ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"] {
        let limits = &tasks["base_limits"][field];
        assert!(limits["min"].as_f64() < limits["max"].as_f64(), "{field}: {limits}");
        assert_eq!(&started["kinds"][0][field], limits);
    }
}
