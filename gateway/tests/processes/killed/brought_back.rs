//! Tests of SIGKILL at random moments of episodes: a restarted server on the same runs folder continues
//! them.
//!
//! No received answer is lost, no action is done twice, and every state is the same as without the kill.

use std::{
    collections::BTreeMap,
    path::Path,
    process::Command,
    sync::{Mutex, atomic::AtomicBool, atomic::Ordering::Relaxed},
    thread,
    time::Duration,
};

use serde_json::{Value, json};
use tandem_episodes::{Recorder, Recording, tasks};

use crate::{Delays, Server};

/// Number of kills in a test, with alternating tasks.
const KILLS: usize = 5;
/// Maximum delay of a kill after the first call.
const LATEST_KILL_MS: u64 = 500;

/// A server that is restarted whenever it has ended.
struct Restarted<'a> {
    runs: &'a Path,
    server: Mutex<(Server, usize)>,
}

impl<'a> Restarted<'a> {
    fn new(runs: &'a Path) -> Restarted<'a> {
        Restarted { runs, server: Mutex::new((Server::start(runs), 0)) }
    }

    fn address(&self) -> (String, usize) {
        let server = self.server.lock().expect("a server");
        (server.0.url.clone(), server.1)
    }

    fn kill(&self) {
        let id = self.server.lock().expect("a server").0.id().to_string();
        assert!(Command::new("kill").args(["-KILL", &id]).status().expect("kill").success());
    }

    /// Returns the status and the answer of a call. The call is repeated with the same key if the server has
    /// ended in the meantime.
    fn call(&self, path: &str, token: Option<&str>, key: &str, body: &Value) -> (u16, Value) {
        let agent: ureq::Agent = ureq::Agent::config_builder().http_status_as_error(false).build().into();
        loop {
            let (url, number) = self.address();
            let mut request = agent.post(format!("{url}{path}")).header("idempotency-key", key);
            if let Some(token) = token {
                request = request.header("authorization", format!("Bearer {token}"));
            }
            let answered = request.send_json(body).and_then(|mut answer| {
                let status = answer.status().as_u16();
                Ok((status, answer.body_mut().read_json::<Value>()?))
            });
            match answered {
                Ok(answer) => return answer,
                Err(_) => {
                    let mut server = self.server.lock().expect("a server");
                    if server.1 == number {
                        *server = (Server::start(self.runs), number + 1);
                    }
                }
            }
        }
    }
}

/// Returns the calls of a policy. The server refuses some of them.
fn script(robot: &str, seed: u64) -> Vec<(&'static str, Value)> {
    let walk = json!({ "steps": 12, "robots": [{ "robot": robot, "vx_m_s": 0.1, "vy_m_s": 0.05, "yaw_rate_rad_s": 0.2 }] });
    let plan = json!({ "commands": [
        { "tool": "wait", "arguments": { "steps": 20 } }, { "tool": "walk", "arguments": walk },
        { "tool": "wait", "arguments": { "steps": 25 } },
    ] });
    let seen = json!({ "steps": 10, "observe": { "robots": [robot] } });
    let pool = [
        ("walk", walk),
        ("send_plan", plan),
        ("observe", json!({})),
        ("wait", seen),
        ("get_robot_state", json!({ "robot": robot })),
        ("wait", json!({ "steps": 0 })),
        ("wait", json!({ "steps": 25 })),
    ];
    let mut choose = Delays(seed);
    (0..16).map(|_| pool[choose.next(pool.len() as u64).as_millis() as usize].clone()).collect()
}

/// Plays a script, during which the server is killed `kill_after` the first call. Returns the answers and
/// the hash of every state.
fn play(task: &str, seed: u64, kill_after: Option<Duration>) -> (Vec<Value>, Vec<(u64, String)>) {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = Restarted::new(runs.path());
    let start = json!({ "task": task, "seed": seed, "protocol": "agentic" });
    let (_, started) = server.call("/v1/episodes", None, "start", &start);
    let id = started["episode_id"].as_str().unwrap_or_else(|| panic!("{started}"));
    let mut answers = Vec::new();
    thread::scope(|scope| {
        if let Some(delay) = kill_after {
            let server = &server;
            scope.spawn(move || {
                thread::sleep(delay);
                server.kill();
            });
        }
        for (number, (tool, arguments)) in script("A", seed).into_iter().enumerate() {
            let path = format!("/v1/episodes/{id}/tools/{tool}");
            let key = number.to_string();
            answers.push(server.call(&path, None, &key, &arguments).1);
        }
        if kill_after.is_some() {
            // The loop waits for the last kill, so that `finish` comes after it.
            while server.address().1 == 0 {
                thread::sleep(Duration::from_millis(20));
                server.call(&format!("/v1/episodes/{id}/tools/get_status"), None, "status", &json!({}));
            }
        }
    });
    let finish = format!("/v1/episodes/{id}/tools/finish");
    let (status, result) = server.call(&finish, None, "finish", &json!({}));
    assert_eq!(status, 200, "{result}");
    let path = runs.path().join(id).join(Recorder::FILE_NAME);
    let recording = Recording::read(&path).expect("a whole recording");
    let hashes = recording.state_hashes().map(|state| state.expect("a state")).collect();
    let verified =
        Command::new(env!("CARGO_BIN_EXE_tandem")).arg("replay").arg(&path).arg("--verify").output();
    let verified = verified.expect("tandem replay");
    assert!(verified.status.success(), "{verified:?}");
    (answers, hashes)
}

fn kill_and_compare(kills: usize, seed: u64) {
    let mut delays = Delays(seed);
    for (round, task) in (0..kills).zip(tasks::cohub().iter().cycle()) {
        let delay = delays.next(LATEST_KILL_MS);
        let episode_seed = seed + round as u64;
        let (answers, hashes) = play(&task.id, episode_seed, Some(delay));
        let (as_ever, undisturbed) = play(&task.id, episode_seed, None);
        assert_eq!(hashes, undisturbed, "{} killed after {delay:?}", task.id);
        for (answer, expected) in answers.iter().zip(&as_ever) {
            assert_eq!(answer["step"], expected["step"], "{}: {answer}", task.id);
            assert_eq!(answer["detail"], expected["detail"], "{}", task.id);
        }
    }
}

#[test]
fn a_killed_server_goes_on_where_it_stood() {
    kill_and_compare(KILLS, 3100);
}

/// Runs the number of kills that the documentation states.
#[test]
#[ignore = "ten minutes: cargo test --release -p tandem --test processes -- --ignored killed_two_hundred"]
fn a_server_that_is_killed_two_hundred_times_goes_on_where_it_stood() {
    kill_and_compare(200, 3200);
}

/// Plays as an operator that talks and acts. Returns the messages that it receives.
fn operate(server: &Restarted, id: &str, robot: &str, token: &str, over: &AtomicBool) -> Vec<String> {
    let mut heard = Vec::new();
    let listen = |answer: &Value, heard: &mut Vec<String>| {
        let words = answer["heard"].as_array().into_iter().flatten();
        heard.extend(words.map(|words| words["text"].as_str().expect("a text").to_owned()));
    };
    for number in 0..8 {
        let words = json!({ "text": format!("{robot} {number}") });
        let walk = json!({ "steps": 10, "robots": [{ "robot": robot, "vx_m_s": 0.1, "vy_m_s": 0.0, "yaw_rate_rad_s": 0.0 }] });
        for (tool, arguments) in [("say", words), ("walk", walk), ("observe", json!({}))] {
            let path = format!("/v1/episodes/{id}/tools/{tool}");
            let (status, answer) = server.call(&path, Some(token), &format!("{tool} {number}"), &arguments);
            assert_eq!(status, 200, "{answer}");
            listen(&answer, &mut heard);
        }
    }
    over.store(true, Relaxed);
    let path = format!("/v1/episodes/{id}/tools/get_status");
    listen(&server.call(&path, Some(token), "last", &json!({})).1, &mut heard);
    heard
}

#[test]
fn operators_go_on_and_hear_everything_once() {
    let mut delays = Delays(3);
    for round in 0..3 {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let server = Restarted::new(runs.path());
        let start =
            json!({ "task": "handover", "seed": 3300 + round, "operators": "per_robot", "talk": true });
        let (_, started) = server.call("/v1/episodes", None, "start", &start);
        let id = started["episode_id"].as_str().unwrap_or_else(|| panic!("{started}"));
        let tokens: BTreeMap<&str, &str> = started["operators"]
            .as_array()
            .into_iter()
            .flatten()
            .filter_map(|operator| Some((operator["robot"].as_str()?, operator["token"].as_str()?)))
            .collect();
        let over = AtomicBool::new(false);
        let heard: Vec<Vec<String>> = thread::scope(|scope| {
            let (server, over) = (&server, &over);
            let kill_after = delays.next(LATEST_KILL_MS);
            scope.spawn(move || {
                thread::sleep(kill_after);
                if !over.load(Relaxed) {
                    server.kill();
                }
            });
            let playing: Vec<_> = tokens
                .iter()
                .map(|(robot, token)| scope.spawn(move || operate(server, id, robot, token, over)))
                .collect();
            playing.into_iter().map(|playing| playing.join().expect("an operator")).collect()
        });
        let said = |robot: &str| (0..8).map(|number| format!("{robot} {number}")).collect::<Vec<_>>();
        for (heard, robot) in heard.iter().zip(["B", "A"]) {
            let expected = said(robot);
            assert_eq!(heard[..], expected[..heard.len()], "once each, in order");
            assert!(heard.len() >= expected.len() - 1, "{heard:?}");
        }
    }
}

/// SIGINT from the keyboard ends the server's episodes; SIGTERM from a service manager does not.
#[test]
fn an_interrupt_ends_episodes_and_a_termination_does_not() {
    for (signal, goes_on) in [("-TERM", true), ("-INT", false)] {
        let runs = tempfile::tempdir().expect("a temporary folder");
        let mut server = Server::start(runs.path());
        let start = json!({ "task": "handover", "seed": 3400, "protocol": "agentic" });
        let id = server.post("/v1/episodes", &start).expect("an episode")["episode_id"].clone();
        let id = id.as_str().expect("an id");
        let before = server.tool(id, "wait", &json!({ "steps": 5 }));
        Command::new("kill").args([signal, &server.id().to_string()]).status().expect("kill");
        server.ended();
        let recording = Recording::read(&runs.path().join(id).join(Recorder::FILE_NAME));
        assert!(recording.expect("a whole recording").result.is_some());
        let server = Server::start(runs.path());
        let after = server.tool(id, "wait", &json!({ "steps": 5 }));
        match goes_on {
            true => assert_eq!(after["step"].as_u64(), before["step"].as_u64().map(|step| step + 5)),
            false => assert_eq!(after["type"], "urn:tandem:problem:unknown-episode"),
        }
    }
}

/// Calls `server` without following redirects. Returns the status, the redirect's target and the answer.
fn ask(server: &Server, method: &str, path: &str, body: &Value) -> (u16, String, Value) {
    let config = ureq::Agent::config_builder().http_status_as_error(false).max_redirects(0);
    let agent: ureq::Agent = config.max_redirects_will_error(false).build().into();
    let url = format!("{}{path}", server.url);
    let mut answer = match method {
        "DELETE" => agent.delete(url).call().expect("an answer"),
        _ => agent.post(url).send_json(body).expect("an answer"),
    };
    let location = answer.headers().get("location").map(|url| url.to_str().expect("a URL").to_owned());
    (answer.status().as_u16(), location.unwrap_or_default(), answer.body_mut().read_json().expect("JSON"))
}

#[test]
fn an_episode_of_another_build_is_named_and_refused_and_its_recording_is_whole() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let server = Server::start(runs.path());
    let start = json!({ "task": "handover", "seed": 3500, "protocol": "agentic" });
    let id = server.post("/v1/episodes", &start).expect("an episode")["episode_id"].clone();
    let id = id.as_str().expect("an id");
    server.tool(id, "wait", &json!({ "steps": 25 }));
    drop(server);
    let journal = runs.path().join(".live").join(format!("{id}.jsonl"));
    let written = std::fs::read_to_string(&journal).expect("a journal");
    let (_, build) = written.split_once(r#""build":""#).expect("a build");
    let (build, _) = build.split_once('"').expect("its end");
    std::fs::write(&journal, written.replacen(build, "0.0.1+old", 1)).expect("another build");

    let server = Server::start(runs.path());
    let path = format!("/v1/episodes/{id}");
    let (status, _, refusal) = ask(&server, "POST", &format!("{path}/tools/wait"), &json!({ "steps": 1 }));
    let says = refusal["detail"].as_str().expect("words");
    assert_eq!((status, &refusal["type"]), (409, &json!("urn:tandem:problem:other-build")), "{refusal}");
    assert!(says.contains("0.0.1+old") && says.contains("start that build"), "{says}");
    let recording = Recording::read(&runs.path().join(id).join(Recorder::FILE_NAME)).expect("a whole one");
    assert!(recording.steps().count() > 300);
    let (status, ..) = ask(&server, "DELETE", &path, &json!({}));
    assert_eq!((status, journal.exists()), (410, false));
}

#[test]
fn an_episode_is_played_by_one_server_and_by_the_next_when_that_has_gone() {
    let runs = tempfile::tempdir().expect("a temporary folder");
    let [first, second] = [(); 2].map(|()| Server::start(runs.path()));
    let start = json!({ "task": "handover", "seed": 3600, "operators": "per_robot" });
    let started = first.post("/v1/episodes", &start).expect("an episode");
    let id = started["episode_id"].as_str().expect("an id");
    let path = format!("/v1/episodes/{id}/tools/get_status?x=1");
    let (status, location, refusal) = ask(&second, "POST", &path, &json!({}));
    assert_eq!((status, location), (307, format!("{}{path}", first.url)), "{refusal}");
    drop(first);
    let token = started["operators"][1]["token"].as_str().expect("a token");
    let agent = ureq::Agent::new_with_defaults();
    let request = agent.post(format!("{}{path}", second.url));
    let mut answer =
        request.header("authorization", format!("Bearer {token}")).send_json(json!({})).expect("200");
    let status: Value = answer.body_mut().read_json().expect("JSON");
    assert_eq!(status["env_steps"], started["status"]["env_steps"], "{status}");
}
