//! A full disk: files may not grow beyond a limit that the system holds.

use std::{path::Path, process::Command, thread, time::Duration};

use serde_json::{Value, json};

use crate::Server;

/// A server whose files may each have at most 256 or 512 kB, depending on the shell's unit.
fn limited(runs: &Path) -> Server {
    let mut limited = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_tandem");
    // The signal would end the process; without it, writes fail as on a full disk.
    limited.args(["-c", "trap '' XFSZ; ulimit -f 512; exec \"$0\" \"$@\"", program]);
    Server::run(limited, runs)
}

fn start(server: &Server, protocol: &str) -> (String, Value) {
    let args = json!({ "task": "handover", "seed": 0, "protocol": protocol });
    let started = server.post("/v1/episodes", &args).expect("an episode");
    (started["episode_id"].as_str().expect("an id").into(), started)
}

fn says_why(failed: &Value) -> bool {
    failed.as_str().is_some_and(|text| text.contains("episode.mcap failed"))
}

#[test]
fn an_episode_goes_on_when_its_recording_cannot() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = limited(runs.path());
    let (id, started) = start(&server, "benchmark");
    assert_eq!(started.get("recording_failed"), None, "there is room for the beginning");
    let mut calls = 0;
    let first = loop {
        calls += 1;
        let reply = server.tool(&id, "wait", &json!({ "steps": 25 }));
        assert_eq!(reply["executed_steps"], 25, "no reply is lost: {reply}");
        if reply.get("recording_failed").is_some() {
            break reply["recording_failed"].clone();
        }
        assert!(calls < 40, "the limit is never reached");
        // The recorder writes a quarter of a second later.
        thread::sleep(Duration::from_millis(300));
    };
    assert!(says_why(&first), "{first}");
    for (tool, args) in [("observe", json!({})), ("get_status", json!({})), ("wait", json!({ "steps": 1 }))] {
        let reply = server.tool(&id, tool, &args);
        assert_eq!(reply["recording_failed"], first, "{tool}");
        calls += 1;
    }
    let result = server.tool(&id, "finish", &json!({}));
    let counted = (&result["tool_calls"], &result["recording_failed"]);
    assert_eq!(counted, (&json!(calls + 1), &first), "{result}");
    let written = std::fs::read_to_string(runs.path().join(&id).join("result.json")).expect("result.json");
    assert_eq!(serde_json::from_str::<Value>(&written).expect("JSON"), result);
}

#[test]
fn the_start_and_refusals_say_that_the_recording_has_failed() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = limited(runs.path());
    // The initial hold is recorded, and its recording does not fit on this disk.
    let (id, started) = start(&server, "agentic");
    let failed = &started["recording_failed"];
    assert!(says_why(failed), "{failed}");
    let status = server.tool(&id, "get_status", &json!({}));
    assert!(status["budget"]["wall_clock_left_s"].as_f64() < Some(1800.0), "the clock runs on: {status}");

    for args in [json!({ "steps": 26 }), json!({ "steps": 0 }), json!({ "step": 1 })] {
        let refused = server.tool(&id, "wait", &args);
        assert_eq!((&refused["status"], &refused["recording_failed"]), (&json!(422), failed), "{refused}");
    }
    let params = json!({ "name": "wait", "arguments": { "episode_id": id, "steps": 26 } });
    let call = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": params });
    let refused = &server.post("/mcp", &call).expect("an answer")["result"];
    assert_eq!(refused["isError"], true, "{refused}");
    assert!(
        refused["content"][1]["text"].as_str().is_some_and(|text| text.contains("episode.mcap failed")),
        "{refused}"
    );
    server.tool(&id, "finish", &json!({}));
    assert_eq!(&server.tool(&id, "wait", &json!({ "steps": 1 }))["recording_failed"], failed);
}
