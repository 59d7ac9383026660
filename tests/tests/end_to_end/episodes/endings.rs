//! Tests of endings: all parties receive the same result.

use std::{
    fs,
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tandem::settings::{Layer, Record};
use tandem_episodes::Recording;
use tandem_tests::TestServer;

fn result_file(server: &TestServer, id: &str) -> Value {
    let text = fs::read_to_string(server.folder(id).join("result.json")).expect("result.json");
    serde_json::from_str(&text).expect("JSON")
}

#[test]
fn everybody_is_told_the_same_result() {
    let server = TestServer::start();
    let id = server.episode("agentic");
    server.tool(&id, "wait", &json!({ "steps": 5 })).ok();
    server.tool(&id, "wait", &json!({ "steps": 26 })).refused(422, &[]);
    server.tool(&id, "observe", &json!({})).ok();
    server.get(&format!("/v1/episodes/{id}")).ok();
    server.tool(&id, "get_status", &json!({})).ok();
    let result = server.tool(&id, "finish", &json!({})).ok();
    assert_eq!((&result["tool_calls"], &result["ended"]), (&json!(5), &json!("finished")), "{result}");

    // The recording is closed by now; later calls are not part of the episode.
    let recording = Recording::read(&server.folder(&id).join("episode.mcap")).expect("a closed recording");
    server.tool(&id, "get_status", &json!({})).ok();
    server.tool(&id, "wait", &json!({ "steps": 1 })).refused(409, &["it was finished"]);
    assert_eq!(recording.tool_calls().expect("its calls").len(), 5);
    assert_eq!(json!(recording.result), result);
    assert_eq!(result_file(&server, &id), result);
    assert_eq!(server.tool(&id, "finish", &json!({})).ok(), result);
    let page = fs::read_to_string(server.folder(&id).join("report.html")).expect("a report");
    assert!(page.contains("<dt>Tool calls</dt><dd>5</dd>"), "{page}");
    assert_eq!(server.delete(&format!("/v1/episodes/{id}")).ok(), result);
    assert_eq!(result_file(&server, &id), result);
}

#[test]
fn an_episode_that_nobody_plays_any_more_gives_its_place_back() {
    let server = TestServer::with(Layer { idle_timeout: Some(1), ..Layer::default() });
    let ids = [server.episode("benchmark"), server.episode("agentic")];
    let deadline = Instant::now() + Duration::from_secs(60);
    for id in &ids {
        while server.get(&format!("/v1/episodes/{id}")).ok()["ended"].is_null() {
            assert!(Instant::now() < deadline, "{id} is still held");
            std::thread::sleep(Duration::from_millis(50));
        }
        let result = result_file(&server, id);
        assert_eq!((&result["ended"], &result["tool_calls"]), (&json!("abandoned"), &json!(0)), "{id}");
        assert!(server.folder(id).join("episode.mcap").exists());
        server.tool(id, "wait", &json!({ "steps": 1 })).refused(409, &["no call came for too long"]);
    }
    server.episode("benchmark");
}

#[test]
fn a_recording_kept_until_the_end_shows_nothing_before() {
    let server = TestServer::with(Layer { record: Some(Record::After), ..Layer::default() });
    let id = server.episode("benchmark");
    server.tool(&id, "wait", &json!({ "steps": 50 })).ok();
    let names = || -> Vec<String> {
        let entries = fs::read_dir(server.folder(&id)).expect("the episode's folder");
        let mut names: Vec<String> = entries
            .map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned())
            .collect();
        names.sort();
        names
    };
    assert_eq!(names(), [""; 0]);
    server.tool(&id, "finish", &json!({})).ok();
    assert_eq!(names(), ["episode.mcap", "report.html", "result.json", "strip.png"]);
    let recording = Recording::read(&server.folder(&id).join("episode.mcap")).expect("a recording");
    assert_eq!(recording.steps().count(), 51);
}
