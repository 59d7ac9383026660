//! Test of the log as JSON, one object per line.

use std::{
    io::{BufRead, BufReader},
    process::{Child, Command, Stdio},
};

use serde_json::{Value, json};
use ureq::Agent;

/// A running program. Dropping it kills the program.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

#[test]
fn every_line_about_an_episode_names_it() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = Command::new(env!("CARGO_BIN_EXE_tandem"))
        .args(["serve", "--log-format", "json", "--listen", "127.0.0.1:0", "--runs"])
        .arg(runs.path())
        .stderr(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let mut server = Running(server);
    let lines = BufReader::new(server.0.stderr.take().expect("its log")).lines().map_while(Result::ok);
    // GPU drivers may write lines before the log.
    let lines = lines.skip_while(|line| !line.starts_with('{'));
    let mut lines = lines.map(|line| serde_json::from_str::<Value>(&line).expect("a line of JSON"));
    let serving = |line: Value| Some(line["message"].as_str()?.split_once("serving on ")?.1.to_owned());
    let url = lines.find_map(serving).expect("the log says where it serves");
    let agent: Agent = Agent::config_builder().http_status_as_error(false).build().new_agent();
    let post =
        |path: &str, body: Value| agent.post(format!("{url}{path}")).send_json(body).expect("an answer");
    post("/v1/episodes", json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }));
    post("/v1/episodes/handover-seed0/tools/wait", json!({ "steps": 0 }));
    let wait = json!({ "name": "wait", "arguments": { "episode_id": "handover-seed0", "steps": 1 } });
    let request = agent.post(format!("{url}/mcp")).header("accept", "application/json, text/event-stream");
    let message = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": wait });
    request.send_json(message).expect("an answer");
    agent.delete(format!("{url}/v1/episodes/handover-seed0")).call().expect("an answer");
    Command::new("kill").args(["-TERM", &server.0.id().to_string()]).status().expect("kill");

    let log: Vec<Value> = lines.collect();
    assert!(server.0.wait().expect("its end").success());
    let about: Vec<&Value> = log.iter().filter(|line| line["episode"] == "handover-seed0").collect();
    let found = |message: &str, field: &str, value: Value| {
        let found = about.iter().any(|line| line["message"] == message && line[field] == value);
        assert!(found, "no {message:?} with {field} {value} in {log:#?}");
    };
    found("started", "level", json!("INFO"));
    found("request", "problem", json!("invalid-arguments"));
    found("request", "method", json!("DELETE"));
    found("call", "tool", json!("wait"));
    found("closed", "level", json!("INFO"));
}
