//! A full disk: files may not grow beyond a limit that the system holds.

use std::process::Command;

use serde_json::{Value, json};

use crate::Server;

#[test]
fn an_episode_goes_on_when_its_recording_cannot() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let mut limited = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_tandem");
    // 256 or 512 kB, as the shell counts. The signal would end the process; without it, writes fail as on a full disk.
    limited.args(["-c", "trap '' XFSZ; ulimit -f 512; exec \"$0\" \"$@\"", program]);
    let server = Server::of(limited, runs.path());
    let start = json!({ "task": "handover", "seed": 0, "protocol": "agentic" });
    let started = server.post("/v1/episodes", &start).expect("an episode");
    let id = started["episode_id"].as_str().expect("an id");

    let mut calls = 0;
    let first = loop {
        calls += 1;
        let reply = server.tool(id, "wait", &json!({ "steps": 25 }));
        assert_eq!(reply["executed_steps"], 25, "no reply is lost: {reply}");
        if reply.get("recording_failed").is_some() {
            break reply["recording_failed"].clone();
        }
        assert!(calls < 100, "the limit is never reached");
    };
    assert!(first.as_str().is_some_and(|text| text.contains("episode.mcap failed")), "{first}");
    for (tool, args) in [("observe", json!({})), ("get_status", json!({})), ("wait", json!({ "steps": 1 }))] {
        let reply = server.tool(id, tool, &args);
        assert_eq!(reply["recording_failed"], first, "{tool}");
        calls += 1;
    }
    let status = server.tool(id, "get_status", &json!({}));
    assert!(status["budget"]["wall_clock_left_s"].as_f64() < Some(1800.0), "the clock runs on: {status}");

    let result = server.tool(id, "finish", &json!({}));
    let counted = (&result["tool_calls"], &result["recording_failed"]);
    assert_eq!(counted, (&json!(calls + 2), &first), "{result}");
    let written = std::fs::read_to_string(runs.path().join(id).join("result.json")).expect("result.json");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), result);
}
