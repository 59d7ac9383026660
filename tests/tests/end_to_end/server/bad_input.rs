//! Tests of bad input: each call is refused with a hint at a valid call, the state hash is unchanged, and the
//! episode continues.

use serde_json::{Value, json};
use tandem_tests::TestServer;

fn row(columns: usize) -> Vec<f64> {
    let mut row = vec![0.0; columns];
    row[columns - 1] = 0.75;
    row
}

fn chunk(rows: &[Vec<f64>]) -> Value {
    json!({ "robots": [{ "robot": "A", "rows": rows }] })
}

fn wrist(field: &str, value: Value) -> Value {
    json!({ "steps": 5, "robots": [{ "robot": "A", field: value }] })
}

/// Returns invalid calls: tool, arguments, expected status, and the texts that the refusal must contain.
fn refused_calls() -> Vec<(&'static str, Value, u16, &'static [&'static str])> {
    vec![
        ("grasp", json!({}), 404, &["\"grasp\"", "observe", "move_wrists", "send_joint_chunk"]),
        ("start_episode", json!({}), 404, &["start_episode", "get_status"]),
        ("get_robot_state", json!({ "robot": "Z" }), 422, &["\"Z\"", "A, B"]),
        ("observe", json!({ "robots": ["A", "C"] }), 422, &["\"C\"", "A, B"]),
        ("move_wrists", json!({ "steps": 5, "robots": [{ "robot": "a" }] }), 422, &["\"a\"", "A, B"]),
        ("query_depth", json!({ "robot": "Z", "pixels": [[0, 0]] }), 422, &["\"Z\"", "A, B"]),
        ("check_reach", json!({ "robot": "Z", "left_position_m": [0.3, 0.2, 0.1] }), 422, &["\"Z\"", "A, B"]),
        ("wait", json!({ "steps": 26 }), 422, &["26", "agentic", "1 to 25"]),
        ("wait", json!({ "steps": 0 }), 422, &["at least 1"]),
        ("wait", json!({ "steps": 2.0, "seconds": 1 }), 422, &["`seconds`"]),
        ("wait", json!({ "steps": "25" }), 422, &["steps", "{\"steps\":25}"]),
        ("wait", json!({ "steps": 2.5 }), 422, &["steps", "a whole number"]),
        ("wait", json!({ "seconds": 1 }), 422, &["`seconds`", "`steps`"]),
        ("wait", json!({ "steps": 1, "episode_id": "other" }), 422, &["\"other\"", "leave episode_id out"]),
        ("move_wrists", json!({ "steps": 26, "robots": [{ "robot": "A" }] }), 422, &["26", "1 to 25"]),
        ("move_wrists", wrist("left_quaternion_wxyz", json!([0, 0, 0, 0])), 422, &["norm 0", "[1, 0, 0, 0]"]),
        ("move_wrists", wrist("left_position_m", json!([1e300, 0, 0])), 422, &["left_position_m", "finite"]),
        ("move_wrists", wrist("right_fingers_rad", json!([0, 0])), 422, &["right_fingers_rad", "7"]),
        ("move_wrists", json!({ "steps": 5, "robots": [] }), 422, &["at least one robot"]),
        ("check_reach", json!({ "robot": "A", "left_quaternion_wxyz": [0, 0, 0, 0] }), 422, &["norm 0"]),
        ("send_joint_chunk", chunk(&[row(34)]), 422, &["34", "35", "left_arm 7"]),
        ("send_joint_chunk", chunk(&vec![row(35); 26]), 422, &["26", "1 to 25"]),
        ("query_depth", json!({ "robot": "A", "pixels": [[320, 0]] }), 422, &["[320, 0]", "0 to 319"]),
        ("query_depth", json!({ "robot": "A", "pixels": [[0, 0], [5, -1]] }), 422, &["[5, -1]", "0 to 239"]),
    ]
}

/// Returns bodies that are not calls: content type, bytes, expected status, and the texts that the refusal
/// must contain.
fn refused_bodies() -> Vec<(&'static str, Vec<u8>, u16, &'static [&'static str])> {
    let json = "application/json";
    vec![
        (json, b"{\"steps\": 5".to_vec(), 400, &["no JSON", "{\"steps\": 25}"]),
        (json, b"steps=5".to_vec(), 400, &["no JSON"]),
        (json, b"{\"steps\": NaN}".to_vec(), 400, &["finite numbers only"]),
        (json, b"{\"steps\": Infinity}".to_vec(), 400, &["finite numbers only"]),
        (json, b"{\"steps\": -Infinity}".to_vec(), 400, &["finite numbers only"]),
        (json, b"{\"steps\": 1e999}".to_vec(), 400, &["finite numbers only"]),
        (json, b"{\"steps\": \"\xff\"}".to_vec(), 400, &["no JSON"]),
        (json, vec![b' '; 10_000_000], 413, &["2000000 bytes"]),
        (json, b"[".repeat(100_000), 400, &["no JSON"]),
        ("application/x-www-form-urlencoded", b"{\"steps\": 5}".to_vec(), 415, &["application/json"]),
        ("text/plain", b"{\"steps\": 5}".to_vec(), 415, &["application/json"]),
        (json, b"[5]".to_vec(), 422, &["the body is an array", "one JSON object"]),
        (json, b"null".to_vec(), 422, &["the body is null"]),
        (json, b"{\"steps\": 5, \"steps\": 6}".to_vec(), 400, &["\"steps\" stands there twice"]),
    ]
}

#[test]
fn bad_input_changes_nothing() {
    let server = TestServer::start();
    let id = server.episode("agentic");
    let status = || {
        let mut status = server.get(&format!("/v1/episodes/{id}")).ok();
        // The policy's wall clock runs during this test.
        status["budget"].as_object_mut().expect("a budget").remove("wall_clock_left_s");
        status
    };
    let before = status();
    assert_eq!(before["env_steps"], 300, "{before}");
    assert!(before["state_hash"].as_str().is_some_and(|hash| hash.len() == 16), "{before}");

    for (tool, args, code, says) in refused_calls() {
        server.tool(&id, tool, &args).refused(code, says);
        assert_eq!(status(), before, "{tool} {args}");
    }
    for (content_type, body, code, says) in refused_bodies() {
        let path = format!("/v1/episodes/{id}/tools/wait");
        server.send("POST", &path, Some(content_type), &body).refused(code, says);
        assert_eq!(status(), before, "{content_type}, {} bytes", body.len());
    }

    let after = server.tool(&id, "wait", &json!({ "steps": 1.0 })).ok();
    assert_eq!(after["executed_steps"], 1, "the episode goes on: {after}");
    assert_ne!(status()["state_hash"], before["state_hash"]);
}

#[test]
fn what_does_not_exist_is_refused_with_what_does() {
    let server = TestServer::start();
    server.get("/v1/episodes/nope").refused(404, &["\"nope\"", "POST /v1/episodes"]);
    server.delete("/v1/episodes/nope").refused(404, &["\"nope\""]);
    server.tool("nope", "wait", &json!({ "steps": 1 })).refused(404, &["\"nope\"", "POST /v1/episodes"]);
    server.get("/v1/episode").refused(404, &["GET /v1/episode ", "GET|POST /v1/episodes"]);
    server.get("/v2").refused(404, &["GET /v1/tools", "GET|POST /v1/episodes"]);
    server.delete("/v1/episodes").refused(405, &["GET|POST /v1/episodes"]);
    server.delete("/v1/tasks").refused(405, &["GET /v1/tasks"]);
    server.get("/v1/episodes/%ff").refused(400, &["UTF-8"]);
    let start = |args: Value| server.post("/v1/episodes", &args);
    start(json!({ "task": "handove", "seed": 0 })).refused(404, &["\"handove\"", "handover"]);
    start(json!({ "task": "handover", "seed": -1 })).refused(422, &["seed", "\"seed\":0"]);
    start(json!({ "task": "handover", "seed": 0, "protocol": "fast" }))
        .refused(422, &["agentic", "benchmark"]);
    start(json!({ "task": "../x", "seed": 0 })).refused(404, &["handover"]);
    start(json!({})).refused(422, &["missing field `task`"]);
    start(Value::Null).refused(422, &["the body is null"]);
    assert_eq!(server.get("/healthz").ok()["episodes"], 0);
}

#[test]
fn targets_beyond_limits_are_clamped_and_reported() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let mut far = row(35);
    (far[0], far[14], far[31]) = (99.0, -99.0, 99.0);
    let reply = server.tool(&id, "send_joint_chunk", &chunk(&[far])).ok();
    let report = &reply["robots"][0];
    let clamped = report["left"]["joints_clamped"].to_string();
    assert!(
        clamped.contains("left_shoulder_pitch_joint") && clamped.contains("left_hand_thumb_0_joint"),
        "{reply}"
    );
    assert_eq!(report["right"].get("joints_clamped"), None, "{reply}");
    assert!(report["base_command_clamped"].to_string().contains("vx_m_s"), "{reply}");
}

#[test]
fn after_the_end_only_status_and_finish_answer() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let result = server.tool(&id, "finish", &json!({})).ok();
    for (tool, args) in [
        ("wait", json!({ "steps": 1 })),
        ("move_wrists", json!({ "steps": 1, "robots": [{ "robot": "A" }] })),
        ("send_joint_chunk", chunk(&[row(35)])),
    ] {
        server.tool(&id, tool, &args).refused(409, &["ended", "get_status", "start_episode"]);
    }
    let status = server.tool(&id, "get_status", &json!({})).ok();
    assert_eq!((&status["ended"], &status["state_hash"]), (&json!("finished"), &result["state_hash"]));
    assert_eq!(server.tool(&id, "finish", &json!({})).ok()["state_hash"], result["state_hash"]);
}

#[test]
fn an_exhausted_budget_ends_the_episode() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let mut last = Value::Null;
    for _ in 0..20 {
        last = server.tool(&id, "wait", &json!({ "steps": 50 })).ok();
    }
    assert_eq!(
        (&last["stop_reason"], &last["budget"]["steps_left"]),
        (&json!("step_budget_exhausted"), &json!(0))
    );
    let hash = || server.tool(&id, "get_status", &json!({})).ok()["state_hash"].clone();
    let before = hash();
    server
        .tool(&id, "wait", &json!({ "steps": 1 }))
        .refused(409, &["control steps are used up", "start_episode"]);
    assert_eq!(hash(), before);
}
