//! Tests of plans and walks of one operator alongside the commands of another.

use serde_json::json;

use super::team::Team;

/// B's wait of 50 steps gets one reply, although A's walk consists of many short commands.
#[test]
fn a_walk_goes_on_beside_the_partners_commands() {
    let team = Team::start(json!({ "patience_s": 5 }));
    let walk = json!({ "steps": 300, "robots": [{ "robot": "A", "to_m": [-0.2, 0.0] }] });
    let (a, waits) = std::thread::scope(|scope| {
        let walks = scope.spawn(|| team.ask(0, "walk_to", walk).ok());
        let mut waits = Vec::new();
        while !walks.is_finished() && waits.len() < 20 {
            waits.push(team.ask(1, "wait", json!({ "steps": 50 })));
        }
        team.ask(1, "finish", json!({}));
        (walks.join().expect("A's reply"), waits)
    });
    assert_eq!(a["stopped"], json!(null), "{a}");
    assert!(a["commands"].as_u64().is_some_and(|commands| commands > 5), "{a}");
    assert_eq!(a["last"]["robots"].as_array().map(Vec::len), Some(1), "{a}");
    let whole =
        waits.into_iter().map(|answer| answer.ok()).filter(|reply| reply["stop_reason"] == "steps_done");
    let whole: Vec<_> = whole.map(|reply| reply["executed_steps"].clone()).collect();
    assert!(whole.len() >= 3 && whole.iter().all(|steps| *steps == 50), "{whole:?}");
    team.verified();
}

#[test]
fn an_operator_waits_in_one_call_until_it_hears() {
    let team = Team::start(json!({ "talk": true, "patience_s": 5 }));
    let until = |heard: bool| {
        json!({ "short": true, "commands": [
            { "tool": "wait", "arguments": { "steps": 400 }, "expects": { "heard": heard }, "until": true },
        ] })
    };
    let b = std::thread::scope(|scope| {
        let waits = scope.spawn(|| team.ask(1, "send_plan", until(true)).ok());
        for _ in 0..2 {
            team.ask(0, "wait", json!({ "steps": 10 })).ok();
        }
        team.ask(0, "say", json!({ "text": "IN PLACE" })).ok();
        // A message is delivered with the reply to the next command.
        team.ask(0, "wait", json!({ "steps": 10 })).ok();
        waits.join().expect("B's reply")
    });
    assert_eq!((&b["stopped"], &b["heard"][0]["text"]), (&json!(null), &json!("IN PLACE")), "{b}");
    assert!(b["executed_steps"].as_u64().is_some_and(|steps| (20..=30).contains(&steps)), "{b}");
    assert!(b["last"]["robots"][0]["left"].get("target").is_none(), "it is short: {b}");
    let of_a = json!([{ "robot": "A", "vx_m_s": 0.1, "vy_m_s": 0, "yaw_rate_rad_s": 0 }]);
    let foreign = json!({ "commands": [{ "tool": "walk", "arguments": { "steps": 5, "robots": of_a } }] });
    team.ask(1, "send_plan", foreign).refused(409, &["yours is \"B\""]);
    team.verified();
}

/// A's walk consists of many short commands. B begins after A's walk, while A waits for B.
#[test]
fn operators_meet_where_both_wait() {
    let team = Team::start(json!({ "patience_s": 20 }));
    let meet = json!({
        "tool": "wait", "arguments": { "steps": 500 }, "expects": { "partners_wait": true }, "until": true,
    });
    let walk = json!({
        "tool": "walk_to",
        "arguments": { "steps": 300, "robots": [{ "robot": "A", "to_m": [-0.1, 0.0] }] },
    });
    let [a, b] = std::thread::scope(|scope| {
        let walks = scope.spawn(|| team.ask(0, "send_plan", json!({ "commands": [walk, &meet] })).ok());
        let waits = scope.spawn(|| team.ask(1, "send_plan", json!({ "commands": [&meet] })).ok());
        [walks, waits].map(|plan| plan.join().expect("a reply"))
    });
    for reply in [&a, &b] {
        assert_eq!(reply["stopped"], json!(null), "{reply}");
    }
    let steps = [&a, &b].map(|reply| reply["executed_steps"].as_u64().expect("steps"));
    assert!(steps[1] > 50 && steps[0].abs_diff(steps[1]) <= 5, "{steps:?}");
    let alone = json!({ "commands": [meet] });
    let single = Team::start(json!({ "patience_s": 0.2 }));
    let reply = single.ask(1, "send_plan", alone).ok();
    let why = reply["stopped"].as_str().expect("A thinks, and does not wait");
    assert!(why.contains("partners_wait is false"), "{why}");
    team.verified();
}

/// A message ends a walk, a plan, and a wait of one operator. The walk of a robot that carries an object ends
/// once the robot stands.
#[test]
fn words_end_what_was_asked_to_end_by_them() {
    let team = Team::start(json!({ "talk": true, "patience_s": 5 }));
    // B may have been held still meanwhile, and must observe before its next command.
    let look = || team.ask(1, "get_robot_state", json!({ "robot": "B" })).ok();
    let until_words = |tool: &str, arguments: serde_json::Value| {
        look();
        std::thread::scope(|scope| {
            let plan = scope.spawn(|| team.ask(1, tool, arguments).ok());
            for _ in 0..2 {
                team.ask(0, "wait", json!({ "steps": 25 })).ok();
            }
            team.ask(0, "say", json!({ "text": "STOP" })).ok();
            let mut waits = 0;
            while !plan.is_finished() && waits < 20 {
                team.ask(0, "wait", json!({ "steps": 25 }));
                waits += 1;
            }
            plan.join().expect("B's reply")
        })
    };
    let walk = |carry: bool| {
        let robots = json!([{ "robot": "B", "to_m": [-1.0, 0.0], "carry": carry }]);
        json!({ "steps": 900, "robots": robots, "until_heard": true })
    };
    // The number of A's waits during B's plan depends on when B's request was received.
    let check = |reply: &serde_json::Value, place: &str| {
        let stopped = reply["stopped"].as_str().unwrap_or_default();
        assert!(stopped.starts_with(place) && stopped.ends_with("A has spoken"), "{reply}");
        assert_eq!(reply["heard"][0]["text"], "STOP", "{reply}");
        reply["executed_steps"].as_u64().expect("steps")
    };
    let reply = until_words("walk_to", walk(false));
    assert!((1..=80).contains(&check(&reply, "A has")), "{reply}");
    let reply = until_words("walk_to", walk(true));
    assert!((1..=300).contains(&check(&reply, "A has")), "{reply}");
    assert_eq!(reply["last"]["robots"][0]["base"]["state"], "standing", "{reply}");
    let waits = vec![json!({ "tool": "wait", "arguments": { "steps": 25 } }); 8];
    let reply = until_words("send_plan", json!({ "commands": waits, "until_heard": true }));
    assert!((1..=100).contains(&check(&reply, "after command ")), "{reply}");
    let from = |robot: &str| {
        let wait = json!({ "tool": "wait", "arguments": { "steps": 400 }, "expects": { "heard_from": robot }, "until": true });
        json!({ "commands": [wait] })
    };
    let reply = until_words("send_plan", from("A"));
    assert!(reply["stopped"].is_null() && reply["executed_steps"].as_u64() < Some(80), "{reply}");
    for robot in ["B", "C"] {
        look();
        team.ask(1, "send_plan", from(robot)).refused(422, &["heard_from", "the others are A"]);
    }
    team.verified();
}
