//! Tests of notes over HTTP: their authorisation, and that they do not affect an episode. Further tests of
//! calls refused before they reach an episode.

use serde_json::{Value, json};
use tandem::hosting::Guests;
use tandem_episodes::{Recorder, Recording, TranscriptEntry};
use tandem_tests::{Answer, TestServer};

fn note(server: &TestServer, id: &str, body: &Value) -> (u16, Vec<u8>) {
    let headers = [("content-type", "application/json")];
    let path = format!("/v1/episodes/{id}/notes");
    let (status, _, bytes) = server.ask("POST", &path, &headers, body.to_string().as_bytes());
    (status, bytes)
}

fn refused(server: &TestServer, id: &str, body: &Value) -> Answer {
    server.post(&format!("/v1/episodes/{id}/notes"), body)
}

fn transcript(server: &TestServer, id: &str) -> Vec<TranscriptEntry> {
    let path = server.folder(id).join(Recorder::FILE_NAME);
    Recording::read(&path).expect("a recording").transcript().expect("its transcript")
}

fn thought() -> Value {
    json!({
        "text": "I look first.", "kind": "thought", "robot": null, "usd": 0.25, "model": "a-model", "seconds": 2.5,
        "tokens": { "input": 1000, "output": 50, "cached": 0 },
    })
}

#[test]
fn a_note_is_kept_and_changes_nothing() {
    let server = TestServer::start();
    let id = server.episode("agentic");
    let standing = || {
        let mut status = server.get(&format!("/v1/episodes/{id}")).ok();
        status["budget"]["wall_clock_left_s"] = Value::Null;
        status
    };
    let before = standing();
    for body in [thought(), json!({ "text": "Only words." }), json!({ "text": "", "usd": 0.5 })] {
        assert_eq!(note(&server, &id, &body), (204, Vec::new()), "{body}");
    }
    assert_eq!(standing(), before);
    let result = server.delete(&format!("/v1/episodes/{id}")).ok();
    assert_eq!((&result["tool_calls"], &result["env_steps"]), (&json!(0), &json!(300)));
    assert_eq!(result["usage"]["notes"], 3);
    assert_eq!((&result["usage"]["input_tokens"], &result["usage"]["usd"]), (&json!(1000), &json!(0.75)));
    assert_eq!(transcript(&server, &id).len(), 3);
}

#[test]
fn a_note_with_a_key_is_kept_once() {
    let mut server = TestServer::start();
    let id = server.episode("agentic");
    let path = format!("/v1/episodes/{id}/notes");
    let keyed = |server: &TestServer, key: &str, body: &Value| {
        let headers = [("content-type", "application/json"), ("idempotency-key", key)];
        server.ask("POST", &path, &headers, body.to_string().as_bytes()).0
    };
    for key in ["a", "a", "b"] {
        assert_eq!(keyed(&server, key, &thought()), 204, "{key}");
    }
    assert_eq!(keyed(&server, "a", &json!({ "text": "Other words." })), 422);
    server.restart(Guests::default());
    assert_eq!(keyed(&server, "b", &thought()), 204);
    assert_eq!(keyed(&server, "a", &json!({ "text": "Other words." })), 422);
    let result = server.delete(&format!("/v1/episodes/{id}")).ok();
    assert_eq!((&result["usage"]["notes"], &result["usage"]["usd"]), (&json!(2), &json!(0.5)));
}

#[test]
fn what_is_no_note_is_refused_and_so_is_one_after_the_end() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    refused(&server, &id, &json!({}))
        .refused(422, &["notes: missing field `text`", "arguments that work", "\"kind\":\"thought\""]);
    refused(&server, &id, &json!({ "text": "a", "kind": "cry" }))
        .refused(422, &["unknown variant `cry`", "`message`"]);
    refused(&server, &id, &json!({ "text": "" })).refused(422, &["it says nothing; give a text"]);
    refused(&server, &id, &json!({ "text": "a".repeat(50_001) }))
        .refused(422, &["50001 characters", "at most 50000"]);
    refused(&server, &id, &json!({ "text": "a", "robot": "C" })).refused(422, &["have: A, B"]);
    refused(&server, "none", &thought()).refused(404, &["no episode \"none\""]);
    server.tool(&id, "finish", &json!({})).ok();
    let late = refused(&server, &id, &thought());
    late.refused(409, &["the episode has ended"]);
    assert_eq!(late.body["result"]["ended"], "finished");
    server.delete(&format!("/v1/episodes/{id}")).ok();
    refused(&server, &id, &thought()).refused(404, &[]);
}

#[test]
fn operators_note_for_their_own_robot() {
    let server = TestServer::start();
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark", "operators": "per_robot" });
    let started = server.post("/v1/episodes", &start).ok();
    let id = started["episode_id"].as_str().expect("an id").to_owned();
    let path = format!("/v1/episodes/{id}/notes");
    let bearer = format!("Bearer {}", started["operators"][1]["token"].as_str().expect("a token"));
    let headers = [("authorization", bearer.as_str()), ("content-type", "application/json")];
    let (status, _, _) = server.ask("POST", &path, &headers, thought().to_string().as_bytes());
    assert_eq!(status, 204);
    let mut of_a = thought();
    of_a["robot"] = "A".into();
    server.post_with(&path, &headers[..1], &of_a).refused(409, &["another operator's", "yours is \"B\""]);
    // The caller that started the episode may add notes, too.
    assert_eq!(note(&server, &id, &of_a).0, 204);
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let robots: Vec<Option<String>> = transcript(&server, &id)
        .into_iter()
        .map(|entry| match entry {
            TranscriptEntry::Note { note, .. } => note.robot,
            TranscriptEntry::Call { call, .. } => panic!("{call:?}"),
        })
        .collect();
    assert_eq!(robots, [Some("B".into()), Some("A".into())]);
}

/// An agent that sends an invalid call gets an error, and the transcript includes it.
#[test]
fn calls_that_cannot_be_read_are_in_the_transcript() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    server.tool(&id, "wait", &json!({ "steps": "five" })).refused(422, &["steps"]);
    server.tool(&id, "grasp", &json!({})).refused(404, &["no tool \"grasp\""]);
    server.tool(&id, "wait", &json!({ "steps": 5, "expected_step": 7 })).refused(409, &["step 0"]);
    let path = format!("/v1/episodes/{id}/tools/wait");
    server.send("POST", &path, Some("application/json"), b"{\"steps\": ").refused(400, &["no JSON"]);
    let arguments = json!({ "episode_id": id, "steps": 0 });
    let over_mcp = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/call",
        "params": { "name": "wait", "arguments": arguments } });
    assert_eq!(server.post("/mcp", &over_mcp).ok()["result"]["isError"], true);
    server.tool(&id, "wait", &json!({ "steps": 5 })).ok();
    let result = server.delete(&format!("/v1/episodes/{id}")).ok();
    assert_eq!(result["tool_calls"], 1, "what does not reach the episode is no call of it");
    let told: Vec<(Option<u32>, String, String, bool)> = transcript(&server, &id)
        .into_iter()
        .map(|entry| match entry {
            TranscriptEntry::Call { number, call, .. } => (number, call.tool, call.arguments, call.ok),
            TranscriptEntry::Note { note, .. } => panic!("{note:?}"),
        })
        .collect();
    let expected = [
        (None, "wait", "{\"steps\":\"five\"}", false),
        (None, "grasp", "{}", false),
        (None, "wait", "{\"steps\":5,\"expected_step\":7}", false),
        (None, "wait", "\"{\\\"steps\\\": \"", false),
        (None, "wait", "{\"steps\":0}", false),
        (Some(1), "wait", "{\"steps\":5}", true),
    ];
    let expected =
        expected.map(|(number, tool, arguments, ok)| (number, tool.to_owned(), arguments.to_owned(), ok));
    assert_eq!(told, expected);
}
