//! Tests of a full disk, which the system's limit on the size of files simulates.

use std::{
    fs,
    path::Path,
    process::{Command, Output},
    thread,
    time::Duration,
};

use serde_json::{Value, json};

use crate::Server;

/// Returns a command that runs the program with files limited to `blocks` blocks of 512 or 1024 bytes,
/// depending on the shell.
fn limited(blocks: u32) -> Command {
    let mut limited = Command::new("sh");
    let program = env!("CARGO_BIN_EXE_tandem");
    // The signal would end the process; without it, writes fail as on a full disk.
    limited.args(["-c", &format!("trap '' XFSZ; ulimit -f {blocks}; exec \"$0\" \"$@\""), program]);
    limited
}

/// Starts a server with space for only the beginning of an episode.
fn small(runs: &Path) -> Server {
    Server::run(limited(512), runs)
}

fn start(server: &Server, protocol: &str) -> (String, Value) {
    let args = json!({ "task": "handover", "seed": 0, "protocol": protocol });
    let started = server.post("/v1/episodes", &args).expect("an episode");
    (started["episode_id"].as_str().expect("an id").into(), started)
}

fn says_why(failed: &Value) -> bool {
    failed.as_str().is_some_and(|text| text.contains("episode.mcap: File too large"))
}

#[test]
fn an_episode_goes_on_when_its_recording_cannot() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = small(runs.path());
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
        // The recorder is up to a quarter of a second behind.
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

    // The part recorded before is intact.
    let partial = runs.path().join(&id).join("episode.mcap.partial");
    let tandem = || Command::new(env!("CARGO_BIN_EXE_tandem"));
    let recovered = ran(tandem(), &["recover"], &partial);
    assert!(recovered.status.success(), "{}", text(&recovered.stderr));
    assert!(!text(&recovered.stdout).contains("left out"), "{}", text(&recovered.stdout));
    let verified = ran(tandem(), &["replay", "--verify"], &partial.with_extension(""));
    assert!(text(&verified.stdout).contains("verified: "), "{}", text(&verified.stdout));
}

#[test]
fn the_start_and_refusals_say_that_the_recording_has_failed() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = small(runs.path());
    // The recording of the initial hold does not fit on this disk.
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
        refused["content"][1]["text"]
            .as_str()
            .is_some_and(|text| text.contains("episode.mcap: File too large")),
        "{refused}"
    );
    server.tool(&id, "finish", &json!({}));
    assert_eq!(&server.tool(&id, "wait", &json!({ "steps": 1 }))["recording_failed"], failed);
}

/// Returns every file in a folder and its subfolders.
fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let mut names: Vec<String> = entries
        .flat_map(|path| if path.is_dir() { files(&path) } else { vec![path.display().to_string()] })
        .collect();
    names.sort();
    names
}

#[test]
fn an_episode_that_cannot_be_recorded_begins_all_the_same_and_leaves_nothing_torn() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = Server::run(limited(8), runs.path());
    let (id, started) = start(&server, "benchmark");
    assert!(says_why(&started["recording_failed"]), "{started}");
    assert!(started["status"]["budget"]["steps_left"].is_u64(), "{started}");
    assert_eq!(files(runs.path()), [""; 0], "no empty file is left");
    let reply = server.tool(&id, "wait", &json!({ "steps": 25 }));
    assert_eq!(
        (&reply["executed_steps"], &reply["recording_failed"]),
        (&json!(25), &started["recording_failed"])
    );
    let result = server.tool(&id, "finish", &json!({}));
    assert_eq!(result["recording_failed"], started["recording_failed"]);
    let result_file = runs.path().join(&id).join("result.json").display().to_string();
    assert_eq!(files(runs.path()), [result_file], "what is too large leaves no part of it");
}

#[test]
fn an_episode_begins_where_its_folder_cannot_be_made() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let runs = place.path().join("runs");
    fs::create_dir(&runs).expect("a folder");
    let server = Server::start(&runs);
    // The disk fails after the launch.
    fs::remove_dir_all(&runs).expect("an empty folder");
    fs::write(&runs, "no folder").expect("a file");
    for number in 1..=2 {
        let (id, started) = start(&server, "benchmark");
        assert_eq!(id, format!("handover-seed0-unrecorded-{number}"));
        let reason = started["recording_failed"].as_str().expect("a reason");
        assert!(reason.contains("give a folder on a disk with space"), "{reason}");
        assert_eq!(server.tool(&id, "wait", &json!({ "steps": 5 }))["executed_steps"], 5);
        assert_eq!(server.tool(&id, "finish", &json!({}))["recording_failed"], reason);
    }
}

fn ran(mut program: Command, flags: &[&str], folder: &Path) -> Output {
    program.args(flags).arg(folder).output().expect("the program starts")
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn a_folder_that_cannot_be_written_is_refused_at_launch() {
    let file = tempfile::NamedTempFile::new().expect("a temporary file");
    let runs = file.path().join("runs");
    for flags in [&["serve", "--listen", "127.0.0.1:0", "--runs"][..], &["demo", "--runs"]] {
        let refused = ran(Command::new(env!("CARGO_BIN_EXE_tandem")), flags, &runs);
        let said = text(&refused.stderr);
        assert!(!refused.status.success() && said.contains("give another --runs"), "{said}");
        assert!(said.contains("Not a directory"), "{said}");
    }
}

#[test]
fn a_demo_says_that_its_recording_failed() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let played = ran(limited(512), &["demo", "--runs"], runs.path());
    let said = text(&played.stdout);
    assert!(!played.status.success() && said.contains("episode.mcap: File too large"), "{said}");
    assert!(said.contains("p3 place reached"), "the episode goes on: {said}");
}

#[test]
fn an_evaluation_stops_at_what_cannot_be_recorded_and_keeps_what_was_played() {
    let place = tempfile::tempdir().expect("a temporary folder");
    let evaluate =
        ["evaluate", "--policy", "expert", "--tasks", "handover", "--seeds", "0..2", "--jobs", "1"];
    let episodes = place.path().join("episodes");
    fs::create_dir(&episodes).expect("a folder");
    // A file blocks the folder of the second episode.
    fs::write(episodes.join("handover-1"), "no folder").expect("a file");
    let flags: Vec<&str> = evaluate.into_iter().chain(["--record", "--out"]).collect();
    let stopped = ran(Command::new(env!("CARGO_BIN_EXE_tandem")), &flags, place.path());
    let said = text(&stopped.stderr);
    assert!(!stopped.status.success() && said.contains("handover seed 1 could not be recorded"), "{said}");
    assert!(said.contains("handover-1: File exists"), "{said}");
    let played = |seed: u32| episodes.join(format!("handover-{seed}.json")).exists();
    assert_eq!([0, 1, 2].map(played), [true, false, false]);
}
