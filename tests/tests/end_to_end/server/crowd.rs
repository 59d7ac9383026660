//! Tests of many simultaneous clients, and of clients over their limits. Each receives a response, or a time
//! to retry.

use std::{
    thread,
    time::{Duration, Instant},
};

use serde_json::json;
use tandem::settings::Layer;
use tandem_tests::{Answer, TestServer};

const CLIENTS: usize = 50;

/// Returns the responses to many clients that send requests at the same time.
fn all_at_once(ask: impl Fn(usize) -> Answer + Sync) -> Vec<Answer> {
    thread::scope(|scope| {
        let clients: Vec<_> = (0..CLIENTS)
            .map(|number| {
                scope.spawn({
                    let ask = &ask;
                    move || ask(number)
                })
            })
            .collect();
        clients.into_iter().map(|client| client.join().expect("a client that is answered")).collect()
    })
}

/// Counts the clients with a regular response, and checks that all others got a time to retry.
#[track_caller]
fn answered(answers: &[Answer], status: u16) -> usize {
    let (good, others): (Vec<&Answer>, Vec<&Answer>) =
        answers.iter().partition(|answer| answer.status == status);
    for other in others {
        assert!(matches!(other.status, 429 | 503), "{other:?}");
        assert!(other.header("retry-after").parse::<u32>().is_ok_and(|seconds| seconds > 0), "{other:?}");
    }
    good.len()
}

#[test]
fn fifty_clients_start_episodes_at_once() {
    let server = TestServer::start();
    let answers = all_at_once(|number| {
        server.post("/v1/episodes", &json!({ "task": "handover", "seed": number, "protocol": "benchmark" }))
    });
    assert_eq!(answered(&answers, 201), 2, "as many as there are places");
    assert_eq!(server.get("/healthz").ok()["episodes"], 2);
}

#[test]
fn fifty_clients_call_one_episode_at_once() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let answers = all_at_once(|_| server.tool(&id, "wait", &json!({ "steps": 1 })));
    let waited = answered(&answers, 200);
    assert!(waited > 0);
    let status = server.tool(&id, "get_status", &json!({})).ok();
    assert_eq!(status["env_steps"], waited, "every answered call is one step, and no refused one is");
}

#[test]
fn fifty_clients_look_at_once() {
    let server = TestServer::start();
    let answers = all_at_once(|number| server.get(if number % 2 == 0 { "/v1/tasks" } else { "/v1/tools" }));
    assert_eq!(answered(&answers, 200), CLIENTS);
}

#[test]
fn who_asks_too_often_is_told_when_to_come_again() {
    let server = TestServer::with(Layer { rate_limit: Some(1), ..Layer::default() });
    let answers: Vec<Answer> = (0..10).map(|_| server.get("/healthz")).collect();
    assert_eq!(answers[0].status, 200);
    let refused =
        answers.iter().find(|answer| answer.status != 200).expect("ten requests take less than 9 s");
    refused.refused(429, &["1 requests a second"]);
    assert_eq!(refused.header("retry-after"), "1");
}

#[test]
fn who_comes_to_a_full_house_is_told_when_to_come_again() {
    let server = TestServer::with(Layer { max_requests: Some(1), ..Layer::default() });
    let id = server.episode("benchmark");
    let deadline = Instant::now() + Duration::from_secs(60);
    thread::scope(|scope| {
        let busy = scope.spawn(|| server.tool(&id, "wait", &json!({ "steps": 50 })));
        while !busy.is_finished() {
            assert!(Instant::now() < deadline, "the call does not end");
            let other = server.get("/healthz");
            if other.status != 200 {
                other.refused(503, &["1 requests are under way"]);
                assert_eq!(other.header("retry-after"), "1");
            }
        }
        answered(&[busy.join().expect("an answer")], 200);
    });
    let (_, metrics) = server.page("/metrics");
    assert!(metrics.contains("tandem_refused_requests_total{problem=\"busy\"}"), "{metrics}");
}
