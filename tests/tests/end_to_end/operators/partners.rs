//! Who else drives beside a person: the task's expert, and programs, whose commands go on over the steps of people.

use std::time::{Duration, Instant};

use serde_json::{Value, json};

use super::{driving::DriversSocket, team::Team};

/// The status of a request for the expert by who has `token`.
fn ask_for_expert(team: &Team, token: Option<&str>) -> u16 {
    let bearer = token.map(|token| format!("Bearer {token}"));
    let mut headers = vec![("content-type", "application/json")];
    headers.extend(bearer.iter().map(|bearer| ("authorization", bearer.as_str())));
    team.server.ask("POST", "/operate/expert", &headers, b"{}").0
}

#[test]
fn an_expert_for_each_robot_plays_the_task_to_its_end() {
    let team = Team::start(json!({ "patience_s": 600, "protocol": "agentic" }));
    assert_eq!(ask_for_expert(&team, None), 403, "it is for who has a robot");
    for token in [&team.tokens[0], &team.tokens[1], &team.tokens[1]] {
        assert_eq!(ask_for_expert(&team, Some(token)), 204);
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
