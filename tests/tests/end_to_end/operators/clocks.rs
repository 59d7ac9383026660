//! Tests of the separate clock of each operator.

use std::{thread::sleep, time::Duration};

use serde_json::{Value, json};
use tandem::settings::Layer;
use tandem_tests::TestServer;

use super::team::Team;

fn wait() -> Value {
    json!({ "steps": 5 })
}

/// A keeps B waiting until A has no time left. B's clock has hardly run by then.
#[test]
fn who_is_waited_for_pays() {
    let server = TestServer::with(Layer { thinking_limit: Some(4), ..Layer::default() });
    let team = Team::on(server, 0, json!({ "protocol": "agentic", "patience_s": 30 }));
    let left_s = |reply: &Value| reply["budget"]["wall_clock_left_s"].as_f64().expect("a limit");
    // Nobody has called yet.
    sleep(Duration::from_millis(1500));
    for reply in team.both(("wait", wait()), ("wait", wait())) {
        let reply = reply.ok();
        assert!(left_s(&reply) > 2.5, "{reply}");
    }
    let b = std::thread::scope(|scope| {
        let waits = scope.spawn(|| team.ask(1, "wait", wait()).ok());
        sleep(Duration::from_millis(2000));
        let a = team.ask(0, "wait", wait()).ok();
        assert!(left_s(&a) < 2.01, "B waited for it: {a}");
        let b = waits.join().expect("B's reply");
        assert!(left_s(&b) > left_s(&a) + 0.5, "{b}");
        let waits = scope.spawn(|| team.ask(1, "wait", wait()).ok());
        sleep(Duration::from_millis(2100));
        team.ask(0, "wait", wait()).refused(409, &["\"A\" has thought for 4 s", "the others play on"]);
        waits.join().expect("B goes on")
    });
    assert_eq!(b["partners"][0]["did"], "held_finished", "{b}");
    sleep(Duration::from_millis(4100));
    team.ask(1, "wait", wait()).refused(409, &["\"B\" has thought for 4 s"]);
    let (result, _) = team.verified();
    assert_eq!(result["ended"], "wall_clock_exhausted", "{result}");
    let used: Vec<_> = result["operators"].as_array().into_iter().flatten().collect();
    assert_eq!(used.iter().map(|one| &one["robot"]).collect::<Vec<_>>(), ["A", "B"], "{result}");
    assert!(used.iter().all(|one| one["requests"].as_u64() >= Some(2)), "{result}");
    assert!(used[0]["thinking_s"].as_f64() >= Some(1.99), "{result}");
}

#[test]
fn a_status_tells_what_the_others_do() {
    let team = Team::start(json!({ "patience_s": 60 }));
    let presence = |robot: usize| team.ask(robot, "get_status", json!({})).ok()["presence"].clone();
    assert_eq!(presence(1), json!([{ "robot": "A", "state": "absent" }]));
    let told = presence(0);
    assert_eq!(told[0]["state"], "thinking", "{told}");
    assert!(told[0]["thinking_s"].is_number(), "{told}");
    std::thread::scope(|scope| {
        let waits = scope.spawn(|| team.ask(0, "wait", wait()).ok());
        while presence(1) != json!([{ "robot": "A", "state": "waiting" }]) {
            assert!(!waits.is_finished(), "B has not commanded");
            sleep(Duration::from_millis(10));
        }
        team.ask(1, "finish", json!({})).ok();
        let told = waits.join().expect("A's reply");
        assert!(told.get("presence").is_none(), "{told}");
    });
    assert_eq!(presence(0), json!([{ "robot": "B", "state": "finished" }]));
    team.verified();
}
