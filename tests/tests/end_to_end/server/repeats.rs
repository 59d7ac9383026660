//! Tests of repeated requests and late commands: no request takes effect twice, and no command acts on an
//! outdated observation.

use serde_json::{Value, json};
use tandem_tests::{Answer, TestServer};

fn keyed(server: &TestServer, path: &str, key: &str, body: &Value) -> Answer {
    server.post_with(path, &[("idempotency-key", key)], body)
}

#[test]
fn a_key_stands_for_one_call() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let path = format!("/v1/episodes/{id}/tools/wait");
    let first = keyed(&server, &path, "k1", &json!({ "steps": 5 }));
    let again = keyed(&server, &path, "k1", &json!({ "steps": 5.0 }));
    assert_eq!((first.header("idempotency-replayed"), again.header("idempotency-replayed")), ("", "true"));
    assert_eq!(first.ok(), again.ok());
    keyed(&server, &path, "k1", &json!({ "steps": 6 })).refused(422, &["a new one for each"]);
    assert_eq!(keyed(&server, &path, "k2", &json!({ "steps": 5 })).ok()["step"], 10);
    keyed(&server, &path, "", &json!({ "steps": 5 })).refused(400, &["1 to 255"]);

    // A refusal is cached as well; a request that cannot be read is refused again in any case.
    let stale = json!({ "steps": 5, "expected_step": 3 });
    let refused = keyed(&server, &path, "k3", &stale);
    refused.refused(409, &["stands at step 10 and not at 3"]);
    assert_eq!(keyed(&server, &path, "k3", &stale).body, refused.body);
    keyed(&server, &path, "k4", &json!({ "steps": 0 })).refused(422, &["at least 1"]);
    let status = server.get(&format!("/v1/episodes/{id}")).ok();
    assert_eq!((&status["step"], &status["env_steps"]), (&json!(10), &json!(10)));
    assert_eq!(server.delete(&format!("/v1/episodes/{id}")).ok()["tool_calls"], 2);
}

#[test]
fn a_key_stands_for_one_start() {
    let server = TestServer::start();
    let start = |key: &str, seed: u32| {
        let body =
            json!({ "task": "handover", "seed": seed, "protocol": "benchmark", "operators": "per_robot" });
        keyed(&server, "/v1/episodes", key, &body)
    };
    let (first, again) = (start("s1", 0), start("s1", 0));
    assert_eq!((again.status, again.header("location")), (201, "/v1/episodes/handover-seed0"));
    assert_eq!(first.ok(), again.ok(), "with the same tokens");
    start("s1", 1).refused(422, &["a new one for each"]);
    assert_eq!(start("s2", 0).ok()["episode_id"], "handover-seed0-2");
    // Failures that may be temporary are not cached.
    start("s3", 0).refused(429, &["all 2 places"]);
    server.delete("/v1/episodes/handover-seed0").ok();
    assert_eq!(start("s3", 0).status, 201);
}

#[test]
fn a_command_on_an_old_view_moves_nothing() {
    let server = TestServer::start();
    let id = server.episode("agentic");
    let seen = server.tool(&id, "observe", &json!({ "short": true })).ok();
    assert_eq!(seen["step"], 300, "the initial hold counts: {}", seen["step"]);
    let wait = |expected: u32| server.tool(&id, "wait", &json!({ "steps": 5, "expected_step": expected }));
    assert_eq!(wait(300).ok()["step"], 305);
    let hash = || server.get(&format!("/v1/episodes/{id}")).ok()["state_hash"].clone();
    let before = hash();
    wait(300).refused(409, &["stands at step 305 and not at 300", "look again"]);
    assert_eq!(hash(), before);
    server.tool(&id, "get_status", &json!({ "expected_step": 305 })).refused(422, &["expected_step"]);
    assert_eq!(wait(305).ok()["step"], 310);
}

#[test]
fn a_command_may_bring_back_what_is_seen_then() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let wait = |look: Value| server.tool(&id, "wait", &json!({ "steps": 5, "observe": look }));
    let reply = wait(json!({ "robots": ["B"], "short": true })).ok();
    let seen = &reply["observation"];
    assert_eq!((&seen["time_s"], &seen["states"][0]["robot"]), (&reply["time_s"], &json!("B")));
    assert!(seen["images"][0]["png_base64"].as_str().is_some_and(|png| png.starts_with("iVBORw0KGgo")));
    // An invalid observation also prevents the command.
    wait(json!({ "robots": ["C"] })).refused(422, &["\"C\"", "A, B"]);
    wait(json!({ "robot": "A" })).refused(422, &["unknown field `robot`"]);
    assert_eq!(server.get(&format!("/v1/episodes/{id}")).ok()["step"], 5);
}
