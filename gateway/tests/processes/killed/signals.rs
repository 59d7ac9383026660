//! Tests of signals. After SIGKILL in an episode, answers older than a second can be read from the disk. A
//! server that SIGTERM ends while an episode starts leaves no partial file. Under `nohup`, it outlives
//! SIGHUP.

use std::{
    path::Path,
    process::Command,
    thread,
    time::{Duration, Instant},
};

use mcap::read::MessageStream;
use serde_json::json;
use tandem_episodes::{Recording, TranscriptEntry};

use crate::skipped::skipped;
use crate::{Delays, Server, hangups_are_ignored, partials};

#[test]
fn a_killed_server_leaves_every_step_that_a_policy_was_told_of_a_second_ago() {
    let mut delays = Delays(2);
    for round in 0..20 {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let delay = delays.next(3000);
        let told_steps = play_and_kill(runs.path(), round, delay);
        let [partial] = &partials(runs.path())[..] else { panic!("no recording after {delay:?}") };
        let recovered = Command::new(env!("CARGO_BIN_EXE_tandem")).arg("recover").arg(partial).output();
        let recovered = recovered.expect("tandem recover");
        let said = String::from_utf8_lossy(&recovered.stdout).into_owned();
        assert!(recovered.status.success(), "{recovered:?}");
        let whole = partial.with_extension("");
        // A kill during a write leaves an incomplete chunk, which recovery leaves out.
        let bytes = std::fs::read(&whole).expect("the recovered file");
        let messages = MessageStream::new(&bytes).expect("MCAP").filter(Result::is_ok).count();
        assert!(said.contains(&format!("{messages} messages")), "{said}, not {messages}");
        let recording = Recording::read(&whole).expect("a whole recording");
        let steps: Vec<u64> = recording.steps().map(|step| step.expect("a step").control_step).collect();
        assert!(steps.windows(2).all(|pair| pair[1] == pair[0] + 1), "a hole: {steps:?}");
        assert!(steps.last() >= Some(&told_steps), "told of {told_steps}, recorded {:?}", steps.last());
        assert_eq!(recording.result, None);
    }
}

#[test]
fn what_was_noted_outlives_the_server() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = Server::start(runs.path());
    let start = json!({ "task": "handover", "seed": 0, "protocol": "agentic" });
    let started = server.post("/v1/episodes", &start).expect("an episode");
    let id = started["episode_id"].as_str().expect("an id");
    // The answer to a note has no body.
    assert_eq!(server.post(&format!("/v1/episodes/{id}/notes"), &json!({ "text": "I wait first." })), None);
    server.tool(id, "wait", &json!({ "steps": 5 }));
    server.tool(id, "wait", &json!({ "steps": "many" }));
    thread::sleep(Duration::from_secs(1));
    Command::new("kill").args(["-KILL", &server.id().to_string()]).status().expect("kill");
    let [partial] = &partials(runs.path())[..] else { panic!("no recording") };
    let recovered = Command::new(env!("CARGO_BIN_EXE_tandem")).arg("recover").arg(partial).output();
    assert!(recovered.expect("tandem recover").status.success());
    let recording = Recording::read(&partial.with_extension("")).expect("a whole recording");
    let told = recording.transcript().expect("its transcript");
    let [
        TranscriptEntry::Note { note, .. },
        TranscriptEntry::Call { .. },
        TranscriptEntry::Call { call, .. },
    ] = &told[..]
    else {
        panic!("{told:?}");
    };
    assert_eq!((note.text.as_str(), call.counted, call.ok), ("I wait first.", false, false));
}

/// Plays until the server is killed, `delay` after the episode began. Returns the number of control steps
/// that answers had reported a second before the kill.
fn play_and_kill(runs: &Path, seed: u32, delay: Duration) -> u64 {
    let server = Server::start(runs);
    let start = json!({ "task": "handover", "seed": seed, "protocol": "agentic" });
    let started = server.post("/v1/episodes", &start).expect("an episode");
    let tools = format!("/v1/episodes/{}/tools", started["episode_id"].as_str().expect("an id"));
    let id = server.id().to_string();
    let mut told = Vec::new();
    let killed = thread::scope(|scope| {
        let killer = scope.spawn(move || {
            thread::sleep(delay);
            let now = Instant::now();
            Command::new("kill").args(["-KILL", &id]).status().expect("kill");
            now
        });
        for steps in (1..=9).cycle() {
            let Some(reply) = server.post(&format!("{tools}/wait"), &json!({ "steps": steps })) else {
                break;
            };
            told.push((Instant::now(), reply["step"].as_u64().expect("a step")));
            if server.post(&format!("{tools}/observe"), &json!({ "robots": ["A"] })).is_none() {
                break;
            }
        }
        killer.join().expect("kill")
    });
    let long_ago = told.iter().rfind(|(when, _)| *when + Duration::from_secs(1) <= killed);
    long_ago.map_or(0, |(_, step)| *step)
}

#[test]
fn a_server_whose_terminal_is_gone_closes_its_recordings() {
    if hangups_are_ignored() {
        return skipped("hangups are ignored here, as under nohup");
    }
    let runs = tempfile::tempdir().expect("a temporary folder");
    let mut server = Server::start(runs.path());
    let start = json!({ "task": "handover", "seed": 0, "protocol": "agentic" });
    let started = server.post("/v1/episodes", &start).expect("an episode");
    server.tool(started["episode_id"].as_str().expect("an id"), "wait", &json!({ "steps": 5 }));
    assert!(Command::new("kill").args(["-HUP", &server.id().to_string()]).status().expect("kill").success());
    assert!(server.ended().success());
    assert!(partials(runs.path()).is_empty());
}

#[test]
fn a_server_that_nohup_started_outlives_its_terminal() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let mut program = Command::new("nohup");
    program.arg(env!("CARGO_BIN_EXE_tandem"));
    let mut server = Server::run(program, runs.path());
    let id = server.id().to_string();
    let signal =
        |name: &str| assert!(Command::new("kill").args([name, &id]).status().expect("kill").success());
    for seed in 0..3 {
        signal("-HUP");
        let start = json!({ "task": "handover", "seed": seed, "protocol": "agentic" });
        let started = server.post("/v1/episodes", &start).expect("the server still runs");
        server.tool(started["episode_id"].as_str().expect("an id"), "wait", &json!({ "steps": 1 }));
    }
    signal("-TERM");
    assert!(server.ended().success());
}

#[test]
fn a_server_that_is_stopped_while_an_episode_starts_ends() {
    let mut delays = Delays(1);
    for round in 0..20 {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let mut server = Server::start(runs.path());
        let id = server.id().to_string();
        let delay = delays.next(1000);
        let answer = thread::scope(|scope| {
            let starting =
                scope.spawn(|| server.post("/v1/episodes", &json!({ "task": "handover", "seed": round })));
            thread::sleep(delay);
            assert!(Command::new("kill").args(["-TERM", &id]).status().expect("kill").success());
            starting.join().expect("the client")
        });
        let status = server.ended();
        assert!(status.success(), "after {delay:?}: {status}");
        assert!(partials(runs.path()).is_empty(), "after {delay:?}: {answer:?}");
    }
}
