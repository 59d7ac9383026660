//! Tests of a server's functions for administrators: metrics, the page that documents the interface, and the
//! tools in every host's format.

use serde_json::{Value, json};
use tandem_tests::TestServer;
use tandem_tools_spec::{Format, Hints, tool_specs};

#[track_caller]
fn has_line(page: &str, line: &str) {
    assert!(page.lines().any(|found| found == line), "no {line:?} in\n{page}");
}

#[test]
fn metrics_count_what_was_done() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    server.tool(&id, "wait", &json!({ "steps": 20 })).ok();
    server.tool(&id, "wait", &json!({ "steps": 0 })).refused(422, &[]);
    server.tool(&id, "grasp", &json!({})).refused(404, &[]);
    let wait = json!({ "name": "wait", "arguments": { "episode_id": id, "steps": 0 } });
    let over_mcp = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": wait });
    assert_eq!(server.post("/mcp", &over_mcp).ok()["result"]["isError"], true);
    let (headers, page) = server.page("/metrics");
    assert_eq!(headers["content-type"], "text/plain; version=0.0.4; charset=utf-8");
    for line in [
        "tandem_episodes_held 1",
        "tandem_episodes_running 1",
        "tandem_episodes_started_total 1",
        "tandem_calls_total{tool=\"start_episode\",status=\"200\"} 1",
        "tandem_calls_total{tool=\"wait\",status=\"200\"} 1",
        "tandem_calls_total{tool=\"wait\",status=\"422\"} 2",
        "tandem_calls_total{tool=\"unknown\",status=\"404\"} 1",
        "tandem_call_duration_seconds_count{tool=\"wait\"} 3",
        "tandem_refused_requests_total{problem=\"invalid-arguments\"} 2",
        "tandem_refused_requests_total{problem=\"unknown-tool\"} 1",
        "tandem_control_steps_total 20",
    ] {
        has_line(&page, line);
    }
    let physics = page.lines().find_map(|line| line.strip_prefix("tandem_physics_seconds_total "));
    assert!(
        physics.is_some_and(|seconds| seconds.parse::<f64>().is_ok_and(|seconds| seconds > 0.0)),
        "{page}"
    );

    server.tool(&id, "finish", &json!({})).ok();
    let ended = "tandem_episodes_ended_total{reason=\"finished\"} 1";
    let page = server.page("/metrics").1;
    has_line(&page, ended);
    has_line(&page, "tandem_episodes_running 0");
    server.delete(&format!("/v1/episodes/{id}")).ok();
    let page = server.page("/metrics").1;
    has_line(&page, ended);
    has_line(&page, "tandem_episodes_held 0");
}

#[test]
fn the_interface_has_a_page() {
    let server = TestServer::start();
    let (headers, page) = server.page("/docs");
    assert_eq!(headers["content-type"], "text/html; charset=utf-8");
    assert!(page.contains("<title>Tandem ") && page.contains("id=\"move_wrists\""), "{page}");
    let policy = headers["content-security-policy"].to_str().expect("a text");
    assert!(policy.starts_with("default-src 'none'"), "{policy}");
}

#[test]
fn tools_are_served_in_the_form_of_every_host() {
    let server = TestServer::start();
    let specs = tool_specs(Hints::On);
    for format in Format::ALL {
        let tools = server.get(&format!("/v1/tools?format={}", format.name())).ok();
        assert_eq!(tools, specs.iter().map(|spec| spec.formatted(format)).collect::<Value>());
    }
    server
        .get("/v1/tools?format=gemini")
        .refused(422, &["\"gemini\"", "openai, openai-chat, anthropic, mcp"]);
}
