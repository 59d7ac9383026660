//! Tests of learned policies on failing servers: each failure ends only the episode in which it occurs, and
//! the result includes the reason.

use std::{thread, time::Duration};

use serde_json::json;
use tandem_evaluation::evaluation::{EvaluationPlan, evaluate};
use tandem_evaluation::policies::Policy;
use tandem_policies::{PolicyMap, PolicyProtocol, RemotePolicy};
use tandem_tools_spec::EndReason;

use super::{
    act_server::ActServer,
    openpi_server::{Decide, OpenpiServer, Reply},
    plans::{plan, play},
    servers::{LEFT_WRIST_COLUMN, map, turning},
};

const FAST: &str = "preset = \"openpi\"\nconnect_s = 0.0\nreply_s = 5.0\n";

/// Returns a policy that holds still for the trial and the first three responses, then replies with `then`.
fn until_then(then: impl Fn() -> Reply + Send + Sync + 'static) -> Box<Decide> {
    let hold = still(20);
    Box::new(move |number, request| if number < 4 { hold(number, request) } else { then() })
}

fn still(rows: usize) -> Box<Decide> {
    turning(|_| (LEFT_WRIST_COLUMN, 0.3), rows)
}

fn array(columns: usize, value: f32) -> Reply {
    Reply::Rows(vec![vec![value; columns]; 20])
}

#[test]
fn a_server_that_fails_ends_its_episode_and_no_other() {
    let server = OpenpiServer::start(|connection| match connection {
        0 => until_then(|| Reply::Nothing),
        1 => until_then(|| {
            Reply::Text("Traceback (most recent call last):\n  ...\nRuntimeError: CUDA out of memory")
        }),
        2 => until_then(|| array(35, f32::NAN)),
        3 => until_then(|| array(32, 0.0)),
        4 => until_then(|| Reply::Silence),
        5 => until_then(|| Reply::Bytes(b"\x82\xa1".into())),
        6 => until_then(|| array(35, 1e9)),
        _ => still(20),
    });
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, vec![server.url()], map(folder.path(), FAST));
    let one_by_one = |seed: u32| {
        let out = folder.path().join(seed.to_string());
        let evaluation = play(&plan(&policy, vec![seed], false), &out);
        let [played] = &evaluation.episodes[..] else { panic!("{evaluation:?}") };
        (played.result.ended, played.result.env_steps, played.note.clone().unwrap_or_default())
    };
    for (seed, says) in [
        (1, "is gone: "),
        (2, "failed: RuntimeError: CUDA out of memory"),
        (3, "row 0, column 0 under the key \"actions\" is NaN"),
        (
            4,
            "expected an array of shape [rows, 35] under the key \"actions\"; came an array of shape [20, 32]",
        ),
        (5, "gave no answer within 5 s"),
        (6, "cannot be read: "),
        (7, "left_shoulder_pitch_joint is beyond 1000"),
    ] {
        let (ended, steps, note) = one_by_one(seed);
        assert_eq!((ended, steps), (EndReason::PolicyFailed, 20), "{note}");
        assert!(note.contains(says), "{note}");
    }
    let (ended, steps, note) = one_by_one(8);
    assert_eq!((ended, steps), (EndReason::StepBudgetExhausted, 1000), "{note}");
}

#[test]
fn a_policy_that_is_not_ready_is_left_out_and_played_the_next_time() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let fast = || map(folder.path(), FAST);
    let left_out = |policy: &RemotePolicy| {
        let evaluation = play(&plan(policy, vec![1], true), folder.path());
        assert_eq!(evaluation.episodes, [], "nothing was begun");
        evaluation.left_out.join(", ")
    };
    let narrow = OpenpiServer::start(|_| Box::new(|_, _| Reply::Rows(vec![vec![0.0; 32]; 50])));
    let text = left_out(&RemotePolicy::new(PolicyProtocol::Openpi, vec![narrow.url()], fast()));
    assert!(text.contains("expected an array of shape [rows, 35]") && text.contains("[50, 32]"), "{text}");
    assert!(!folder.path().join("episodes/handover-1").exists(), "no world was made");

    let sound = OpenpiServer::start(|_| still(50));
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, vec![sound.url()], fast());
    assert_eq!(play(&plan(&policy, vec![1], false), folder.path()).episodes.len(), 1);
    let asked = || sound.requests.lock().expect("no panic").len();
    let before = asked();
    play(&plan(&policy, vec![1], false), folder.path());
    assert_eq!(asked(), before, "it is kept");
    let longer = PolicyMap { reply_s: 6.0, ..fast() };
    let longer = RemotePolicy::new(PolicyProtocol::Openpi, vec![sound.url()], longer);
    let other = evaluate(&plan(&longer, vec![1], false), folder.path(), &|_| {});
    let refused = other.expect_err("another map is another policy").to_string();
    assert!(refused.contains("policy_settings.reply_s is 6"), "{refused}");
    assert_eq!(asked(), before, "nobody is asked");
}

/// Returns an address without a server.
fn nowhere() -> std::net::SocketAddr {
    std::net::TcpListener::bind("127.0.0.1:0").expect("a port").local_addr().expect("an address")
}

#[test]
fn an_evaluation_without_its_server_stops_and_goes_on_later() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let fast = map(folder.path(), FAST);
    let refusal = |policy: &RemotePolicy| {
        let one_by_one = EvaluationPlan { jobs: 1, ..plan(policy, vec![1, 2, 3, 4], false) };
        evaluate(&one_by_one, folder.path(), &|_| {}).expect_err("nobody plays").to_string()
    };
    for (protocol, scheme) in [
        (PolicyProtocol::Openpi, "ws://"),
        (PolicyProtocol::Act, "http://"),
        (PolicyProtocol::XPolicyLab, "ws://"),
    ] {
        let absent = [nowhere(), nowhere()].map(|address| format!("{scheme}{address}"));
        let text = refusal(&RemotePolicy::new(protocol, absent.to_vec(), fast.clone()));
        for url in &absent {
            assert!(text.contains(&format!("no policy answers at {url}")), "{text}");
        }
        assert!(text.contains("Start its server") && text.contains("connect_s"), "{text}");
        assert!(text.contains("run the same command again: of 4 episodes 0 are played and kept"), "{text}");
    }

    // The progress of the run includes the reason for its wait.
    let slow = PolicyMap { connect_s: 1.5, ..fast.clone() };
    let url = format!("ws://{}", nowhere());
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, vec![url.clone()], slow);
    let told = thread::scope(|scope| {
        let stopped = scope.spawn(|| refusal(&policy));
        let mut told = None;
        while !stopped.is_finished() {
            told = policy.waiting().or(told);
            thread::sleep(Duration::from_millis(20));
        }
        told
    });
    let told = told.map(|wait| wait.to_string()).unwrap_or_default();
    assert!(told.starts_with(&format!("waiting for {url}, ")), "{told}");

    // A server that stops after two episodes and is started again.
    let address = nowhere();
    let short = OpenpiServer::start_at(address, 2, |_| still(50));
    let policy = RemotePolicy::new(PolicyProtocol::Openpi, vec![short.url()], fast.clone());
    let text = refusal(&policy);
    assert!(text.contains("of 4 episodes 2 are played and kept"), "{text}");
    assert_eq!(policy.waiting(), None);
    let back = OpenpiServer::start_at(address, 2, |_| still(50));
    let evaluation = play(&plan(&policy, vec![1, 2, 3, 4], false), folder.path());
    assert_eq!((evaluation.episodes.len(), evaluation.left_out.len()), (4, 0));
    let [before, after] = [&short, &back].map(|server| server.requests.lock().expect("no panic").len());
    assert_eq!(before, after, "two episodes each");
}

#[test]
fn what_a_server_behind_act_refuses_is_told() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let told = |status: u16, reply: serde_json::Value| {
        let server = ActServer::start(move |_| (status, reply.clone()));
        let policy = RemotePolicy::new(PolicyProtocol::Act, vec![server.url()], map(folder.path(), FAST));
        play(&plan(&policy, vec![1], false), folder.path()).left_out.join(", ")
    };
    for (status, reply, says) in [
        (500, json!({ "detail": "no model" }), "failed: 500"),
        (200, json!("error"), "came the text \"error\""),
        (200, json!({ "actions": [[1, 2], [3]] }), "came a list of 2 that is no array of numbers"),
        (
            200,
            json!({ "actions": { "__numpy__": "AA==", "dtype": "<f4", "shape": [1] } }),
            "shape [1] with 0 elements",
        ),
    ] {
        let text = told(status, reply);
        assert!(text.contains(says), "{text}");
    }
}

/// Error page of nginx without an upstream server.
const PAGE: &str =
    "<html>\r\n<head><title>502 Bad Gateway</title></head>\r\n<body>\r\n</body>\r\n</html>\r\n";

#[test]
fn a_page_in_html_is_shown() {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let told = |status: u16, protocol: PolicyProtocol| {
        let server = ActServer::start_with_text(move |_| (status, PAGE.into()));
        let url = match protocol {
            PolicyProtocol::Act => server.url(),
            PolicyProtocol::Openpi | PolicyProtocol::XPolicyLab => format!("ws://{}", server.address),
        };
        let policy = RemotePolicy::new(protocol, vec![url], map(folder.path(), FAST));
        match evaluate(&plan(&policy, vec![1], false), folder.path(), &|_| {}) {
            Ok(evaluation) => evaluation.left_out.join(", "),
            // This page may mean that no policy server is running.
            Err(error) => error.to_string(),
        }
    };
    let page = "<html> <head><title>502 Bad Gateway</title></head> <body>";
    for (status, protocol, says) in [
        (502, PolicyProtocol::Act, "failed: 502 Bad Gateway: "),
        (200, PolicyProtocol::Act, "expected JSON; came, with status 200 OK, \""),
        (502, PolicyProtocol::Openpi, "it answers HTTP 502 Bad Gateway: "),
        (502, PolicyProtocol::XPolicyLab, "it answers HTTP 502 Bad Gateway: "),
        (200, PolicyProtocol::Openpi, "it answers HTTP 200 OK: "),
    ] {
        let text = told(status, protocol);
        assert!(text.contains(&format!("{says}{page}")), "{text}");
    }
}

#[test]
fn a_server_that_sends_elsewhere_is_not_followed() {
    let server = ActServer::start(|_| (307, json!({})));
    let folder = tempfile::tempdir().expect("a temporary folder");
    let policy = RemotePolicy::new(PolicyProtocol::Act, vec![server.url()], map(folder.path(), FAST));
    let evaluation = play(&plan(&policy, vec![1], false), folder.path());
    let [left_out] = &evaluation.left_out[..] else { panic!("{evaluation:?}") };
    assert!(
        left_out.contains("it sends elsewhere") && left_out.contains("name that address in --policy"),
        "{left_out}"
    );
}
