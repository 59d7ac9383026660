//! Tests of hints: the server's texts for policies include instructions on grasping only with hints, and so
//! does the recording.

use serde_json::{Value, json};
use tandem::settings::Layer;
use tandem_episodes::Recording;
use tandem_tests::TestServer;
use tandem_tools_spec::Hints;

/// Returns every text about tools and hands that a server with these hints shows.
fn texts(hints: Hints) -> Vec<(&'static str, Value)> {
    let server = TestServer::with(Layer { hints: Some(hints), ..Layer::default() });
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
    let started = server.post("/v1/episodes", &start).ok();
    let id = started["episode_id"].as_str().expect("an id").to_owned();
    let listed = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {} });
    let texts = vec![
        ("the list of tools", server.get("/v1/tools").ok()),
        ("the episode's list of tools", server.get(&format!("/v1/episodes/{id}/tools")).ok()),
        ("OpenAPI", server.get("/v1/openapi.json").ok()),
        ("MCP", server.post("/mcp", &listed).ok()),
        ("the brief", started["brief"].clone()),
    ];
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let recording = Recording::read(&server.folder(&id).join("episode.mcap")).expect("a recording");
    assert_eq!(recording.spec.hints, hints);
    texts
}

#[test]
fn the_brief_says_how_to_grasp_where_hints_are_on() {
    let recipes = |text: &Value| text.to_string().contains("close to close_rad in");
    for (face, text) in texts(Hints::On) {
        assert_eq!(recipes(&text), face == "the brief", "recipes are in the brief alone, {face}: {text}");
    }
    for (face, text) in texts(Hints::Off) {
        assert!(!recipes(&text), "{face} says how to grasp: {text}");
        assert!(text.to_string().contains("0.12"), "{face} says nothing of a hand's geometry: {text}");
    }
}

#[test]
fn a_running_episode_lists_its_tools_with_its_own_limits() {
    let server = TestServer::start();
    for (protocol, most_steps) in [("agentic", 25), ("benchmark", 50)] {
        let id = server.episode(protocol);
        let tools = server.get(&format!("/v1/episodes/{id}/tools")).ok();
        let wait = tools.as_array().into_iter().flatten().find(|tool| tool["name"] == "wait").expect("wait");
        assert_eq!(wait["body_schema"]["properties"]["steps"]["maximum"], most_steps);
        let path = wait["route"]["path"].as_str().expect("a path");
        assert_eq!(server.post(path, &json!({ "steps": most_steps })).status, 200);
        server.post(path, &json!({ "steps": most_steps + 1 })).refused(422, &[]);
    }
    server.get("/v1/episodes/nope/tools").refused(404, &["\"nope\""]);
}
