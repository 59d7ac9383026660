//! Tests of the partners of a human operator: the task's expert, a learned policy, and programs whose
//! commands span several of the operator's steps.

use std::{
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::{Duration, Instant},
};

use serde_json::{Value, json};
use tandem::hosting::Guests;
use tandem_policies::{PolicyMap, PolicyProtocol, RemotePolicy};
use tandem_tests::TestServer;

use super::{driving::DriversSocket, team::Team};
use crate::policies::act_server::ActServer;

pub const EXPERT: &str = "/operate/expert";
pub const POLICY: &str = "/operate/policy";

/// Requests a partner at `path` for robot B, as the caller with `token`, or as the caller that started the
/// episode.
fn asked_for(team: &Team, path: &str, token: Option<&str>) -> (u16, Value) {
    answer_to(team, path, token, json!({ "episode": team.id, "robot": "B" }))
}

fn answer_to(team: &Team, path: &str, token: Option<&str>, body: Value) -> (u16, Value) {
    let bearer = token.map(|token| format!("Bearer {token}"));
    let mut headers = vec![("content-type", "application/json")];
    headers.extend(bearer.iter().map(|bearer| ("authorization", bearer.as_str())));
    let answer = team.server.ask("POST", path, &headers, body.to_string().as_bytes());
    (answer.0, serde_json::from_slice(&answer.2).unwrap_or_default())
}

/// Requests a partner as the caller that started the episode, and returns the status.
pub fn ask_for(team: &Team, path: &str) -> u16 {
    asked_for(team, path, None).0
}

/// Starts a server that offers the policy at `url` as a partner.
fn server_with_policy(url: &str) -> TestServer {
    TestServer::with_guests(Default::default(), guests_with_policy(url))
}

pub fn guests_with_policy(url: &str) -> Guests {
    let map = PolicyMap::find("openpi").expect("a preset");
    let policy = RemotePolicy::new(PolicyProtocol::Act, vec![url.into()], map);
    Guests { partner: Some(Arc::new(policy)), ..Guests::default() }
}

#[test]
fn an_expert_for_each_robot_plays_the_task_to_its_end() {
    let team = Team::start(json!({ "patience_s": 600, "protocol": "agentic" }));
    for robot in ["A", "B", "B"] {
        let asked = json!({ "episode": team.id, "robot": robot });
        assert_eq!(answer_to(&team, EXPERT, None, asked).0, 204);
    }
    let began = Instant::now();
    while team.server.get(&format!("/v1/episodes/{}", team.id)).ok()["ended"].is_null() {
        assert!(began.elapsed() < Duration::from_secs(120), "nobody ends it");
        std::thread::sleep(Duration::from_millis(100));
    }
    let (result, recording) = team.verified();
    assert!(result["phases"]["p3"].is_number(), "{result}");
    assert!(
        result["extra_information"].as_array().is_some_and(|named| named.contains(&json!("third_person")))
    );
    let notes = recording.transcript().expect("a transcript");
    assert!(format!("{notes:?}").contains("The task's expert drives robot B."));
}

/// An operator's token cannot start the expert or a policy, neither for the operator's robot nor for a
/// teammate.
#[test]
fn who_started_the_episode_decides_who_drives_beside_operators() {
    let act = ActServer::start(|_| (200, json!({ "actions": [] })));
    let team = Team::on(server_with_policy(&act.url()), 0, json!({ "patience_s": 0.05 }));
    for token in &team.tokens {
        for path in [EXPERT, POLICY] {
            for body in [json!({ "episode": team.id, "robot": "B" }), json!({ "robot": "A" }), json!({})] {
                let (status, told) = answer_to(&team, path, Some(token), body);
                assert_eq!((status, &told["title"]), (403, &json!("Not for operators")), "{told}");
            }
        }
    }
    let one = team
        .server
        .post("/v1/episodes", &json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }))
        .ok();
    for (body, status, says) in [
        (json!({ "episode": team.id, "robot": "C" }), 422, "no robot \"C\""),
        (json!({ "episode": "x", "robot": "A" }), 404, "no episode \"x\""),
        (json!({ "episode": one["episode_id"], "robot": "A" }), 409, "add \"operators\": \"per_robot\""),
        (json!({ "robot": "A" }), 400, "missing field `episode`"),
    ] {
        let (answered, told) = answer_to(&team, EXPERT, None, body);
        assert!(answered == status && told.to_string().contains(&says.replace('"', "\\\"")), "{told}");
    }
    assert_eq!(act.requests.lock().expect("no panic").len(), 0, "no policy was asked");
    team.ask(0, "wait", json!({ "steps": 1 })).ok();
    let (result, recording) = team.verified();
    assert!(!result["extra_information"].to_string().contains("third_person"), "{result}");
    assert!(!format!("{:?}", recording.transcript().expect("a transcript")).contains("drives robot"));
}

#[test]
fn beside_a_person_a_longer_command_goes_on() {
    let team = Team::start(json!({ "patience_s": 600, "protocol": "agentic" }));
    let mut page = DriversSocket::open(&team, 0);
    let args = json!({
        "steps": 10, "robots": [{ "robot": "B", "right_position_m": [0.25, -0.2, 0.2] }], "observe": { "images": "png" },
    });
    std::thread::scope(|scope| {
        let commanded = scope.spawn(|| team.ask(1, "move_wrists", args).ok());
        while !commanded.is_finished() {
            page.say(json!({}), true);
            page.read();
        }
        let reply = commanded.join().expect("an answer");
        assert_eq!((&reply["executed_steps"], &reply["stop_reason"]), (&json!(10), &json!("steps_done")));
        assert!(!reply["observation"].is_null(), "{reply}");
    });
    drop(page);
    let (_, recording) = team.verified();
    let calls = recording.tool_calls().expect("calls");
    let together: Vec<Value> =
        calls.into_iter().filter(|call| call.tool == "together").map(|call| call.arguments).collect();
    assert!(together.len() >= 10, "{} steps of the person's", together.len());
}

#[test]
fn a_learned_policy_drives_its_own_robot_beside_a_person() {
    // 10 rows of 35 numbers: both arms raised, the base at rest.
    let mut row = vec![0.0; 35];
    (row[0], row[7], row[34]) = (-0.6, -0.6, 0.76);
    let act = ActServer::start(move |_| (200, json!({ "actions": vec![row.clone(); 10] })));
    let server = server_with_policy(&act.url());
    assert_eq!(server.get("/operate/policy").ok()["policy"], json!(format!("act:{}", act.url())));
    let team = Team::on(server, 0, json!({ "patience_s": 600, "protocol": "agentic" }));
    for _ in 0..2 {
        assert_eq!(ask_for(&team, POLICY), 204);
    }
    let mut page = DriversSocket::open(&team, 0);
    let began = Instant::now();
    let raised = |robot: usize, name: &str| {
        let state = team.ask(robot, "get_robot_state", json!({ "robot": name })).ok();
        state["joint_positions_rad"]["right_shoulder_pitch_joint"].as_f64().expect("an angle")
    };
    let held = raised(0, "A");
    while (raised(1, "B") + 0.6).abs() > 0.1 {
        assert!(began.elapsed() < Duration::from_secs(120), "the arm is not raised");
        page.say(json!({}), true);
        page.read();
    }
    assert!((raised(0, "A") - held).abs() < 0.05, "the person's robot does not do what the policy tells it");
    drop(page);
    let (_, recording) = team.verified();
    let notes = recording.transcript().expect("a transcript");
    assert!(format!("{notes:?}").contains(&format!("The policy act:{} drives robot B.", act.url())));
}

#[test]
fn no_page_names_an_address_of_its_own() {
    let team = Team::start(json!({ "patience_s": 600 }));
    assert_eq!(team.server.get("/operate/policy").ok()["policy"], Value::Null);
    assert_eq!(ask_for(&team, POLICY), 409);
    let bearer = format!("Bearer {}", team.tokens[1]);
    let asked = team.server.ask("GET", "/operate/policy", &[("authorization", &bearer)], b"");
    assert_eq!(asked.0, 403, "it is for who starts episodes");
}

#[test]
fn a_policy_that_is_not_there_is_told_of_and_may_be_asked_for_again() {
    let act = ActServer::start(|_| (500, json!({ "error": "no weights" })));
    let team = Team::on(server_with_policy(&act.url()), 0, json!({ "patience_s": 600 }));
    for _ in 0..2 {
        assert_eq!(ask_for(&team, POLICY), 409);
    }
    assert!(act.requests.lock().expect("no panic").len() >= 2, "it is asked each time");
}

#[test]
fn a_policy_that_was_lost_may_be_asked_for_again_and_nobody_waits_for_it() {
    let (broken, failed) = (Arc::new(AtomicBool::new(false)), Arc::new(AtomicBool::new(false)));
    let mut row = vec![0.0; 35];
    row[34] = 0.76;
    let (is_broken, has_failed) = (broken.clone(), failed.clone());
    let act = ActServer::start(move |_| match is_broken.load(Ordering::SeqCst) {
        true => {
            has_failed.store(true, Ordering::SeqCst);
            (500, json!({ "error": "out of memory" }))
        }
        false => (200, json!({ "actions": vec![row.clone(); 5] })),
    });
    let team =
        Team::on(server_with_policy(&act.url()), 0, json!({ "patience_s": 600, "protocol": "agentic" }));
    assert_eq!(ask_for(&team, POLICY), 204);
    let mut page = DriversSocket::open(&team, 0);
    let asked = || act.requests.lock().expect("no panic").len();
    let mut drive_until = |done: &dyn Fn() -> bool| {
        let began = Instant::now();
        while !done() {
            assert!(began.elapsed() < Duration::from_secs(120), "nothing happens");
            page.say(json!({}), true);
            page.read();
        }
    };
    drive_until(&|| asked() >= 4);
    broken.store(true, Ordering::SeqCst);
    drive_until(&|| failed.load(Ordering::SeqCst));
    broken.store(false, Ordering::SeqCst);
    let before = asked();
    // A request is only noted while the failed policy is still ending.
    drive_until(&|| {
        assert_eq!(ask_for(&team, POLICY), 204);
        asked() >= before + 3
    });
    drop(page);
    let (_, recording) = team.verified();
    let notes = format!("{:?}", recording.transcript().expect("a transcript"));
    assert!(
        notes.contains("The policy of robot B has stopped") && notes.contains("out of memory"),
        "{notes}"
    );
    assert_eq!(notes.matches("drives robot B.").count(), 2, "{notes}");
}
