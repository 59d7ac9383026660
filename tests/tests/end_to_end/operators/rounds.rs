//! Tests of the rounds of the operators' commands, and of each operator's observations and messages.

use std::sync::mpsc;

use serde_json::{Value, json};
use tandem::settings::Layer;
use tandem_episodes::stress::{StressAxis, StressLevel};
use tandem_tests::TestServer;

use super::team::Team;

fn names<'a>(list: &'a Value, field: &str) -> Vec<&'a str> {
    list.as_array().into_iter().flatten().filter_map(|entry| entry[field].as_str()).collect()
}

/// Returns a row with which a robot under joint control stands.
fn row() -> Vec<f64> {
    let mut row = vec![0.0; 35];
    row[34] = 0.75;
    row
}

#[test]
fn an_operator_sees_and_commands_its_own_robot_alone() {
    let team = Team::start(json!({}));
    let seen = team.ask(1, "observe", json!({ "short": true })).ok();
    assert_eq!((names(&seen["states"], "robot"), names(&seen["images"], "robot")), (vec!["B"], vec!["B"]));
    assert_eq!(names(&team.ask(1, "get_status", json!({})).ok()["fallen"], "robot"), ["B"]);
    for (tool, args) in [
        ("observe", json!({ "robots": ["A"] })),
        ("get_robot_state", json!({ "robot": "A" })),
        ("query_depth", json!({ "robot": "A", "pixels": [[160, 120]] })),
        ("move_wrists", json!({ "steps": 5, "robots": [{ "robot": "B" }, { "robot": "A" }] })),
        ("send_joint_chunk", json!({ "robots": [{ "robot": "A", "rows": [row()] }] })),
        ("wait", json!({ "steps": 5, "observe": { "robots": ["A"] } })),
    ] {
        team.ask(1, tool, args).refused(409, &["robot \"A\" is another operator's", "yours is \"B\""]);
    }
    team.ask(1, "get_robot_state", json!({ "robot": "C" })).refused(422, &["no robot \"C\"", "have: A, B"]);
    let episode = format!("/v1/episodes/{}", team.id);
    let bearer = format!("Bearer {}", team.tokens[1]);
    let own = [("authorization", bearer.as_str())];
    let status = |method: &str, path: &str| team.server.ask(method, path, &own, b"").0;
    assert_eq!(status("GET", &episode), 200);
    let (_, _, briefing) = team.server.ask("GET", &format!("{episode}/briefing"), &own, b"");
    let briefing: Value = serde_json::from_slice(&briefing).expect("JSON");
    assert_eq!(names(&briefing["instructions"], "robot"), ["B"]);
    assert_eq!(
        briefing["http"][0],
        format!("GET {episode}/tools lists your tools, each with the schema of its body.")
    );
    assert!(
        briefing["http"][1]
            .as_str()
            .is_some_and(|line| line.starts_with(&format!("POST {episode}/tools/NAME ")))
    );
    assert!(briefing["brief"]["frames"].is_string() && !briefing.to_string().contains(&team.tokens[0]));
    assert_eq!(status("DELETE", &episode), 403);
    assert_eq!(status("GET", "/metrics"), 403);
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
    team.server.post_with("/v1/episodes", &own, &start).refused(403, &["who started the episode"]);
    let other = team.server.episode("benchmark");
    assert_eq!(status("GET", &format!("/v1/episodes/{other}")), 404, "it is not theirs to know of");
    team.server.tool_as(&team.tokens[1], &other, "wait", &json!({ "steps": 1 })).refused(404, &[]);
    // Only the operators may command robots, and a policy that directs all robots has no teammate to talk to.
    team.server.tool(&team.id, "wait", &json!({ "steps": 1 })).refused(403, &["Authorization: Bearer"]);
    team.server.tool(&other, "say", &json!({ "text": "Hello." })).refused(409, &["per_robot"]);
    assert_eq!(team.server.get(&episode).ok()["env_steps"], 0);
}

#[test]
fn a_step_is_made_when_both_have_commanded_and_the_shorter_command_ends_it() {
    let team = Team::start(json!({}));
    let reach = json!({ "steps": 10, "robots": [{ "robot": "A", "right_position_m": [0.3, -0.2, 0.15] }] });
    let rows =
        json!({ "robots": [{ "robot": "B", "rows": vec![row(); 4] }], "observe": { "images": "rgb" } });
    let [a, b] = team.both(("move_wrists", reach), ("send_joint_chunk", rows)).map(|answer| answer.ok());
    for reply in [&a, &b] {
        assert_eq!((&reply["executed_steps"], &reply["step"]), (&json!(4), &json!(4)), "{reply}");
    }
    assert_eq!((&a["stop_reason"], &b["stop_reason"]), (&json!("partner_done"), &json!("steps_done")));
    assert_eq!(a["partners"], json!([{ "robot": "B", "did": "acted", "tool": "send_joint_chunk" }]));
    assert_eq!((names(&a["robots"], "robot"), names(&b["robots"], "robot")), (vec!["A"], vec!["B"]));
    assert_eq!(a["robots"][0]["right"]["state"], "moving", "four tenths of the way: {a}");
    assert!(a.get("observation").is_none());
    assert_eq!(names(&b["observation"]["arrays"], "robot"), ["B"]);

    // Neither an observation nor a refused command interferes with the next command.
    team.ask(0, "wait", json!({ "steps": 51 })).refused(422, &["1 to 50"]);
    team.ask(0, "wait", json!({ "steps": 5, "expected_step": 3 })).refused(409, &["stands at step 4"]);
    let wait = || ("wait", json!({ "steps": 6, "expected_step": 4 }));
    let both = team.both(wait(), wait()).map(|answer| answer.ok()["step"].clone());
    assert_eq!(both, [10, 10]);
    let (result, recording) = team.verified();
    assert_eq!(result["env_steps"], 10);
    let calls = recording.tool_calls().expect("its calls");
    let calls: Vec<_> = calls
        .iter()
        .map(|call| (call.tool.as_str(), call.operator.as_deref(), call.outcome.is_ok()))
        .collect();
    assert_eq!(
        calls,
        [
            ("together", None, true),
            ("observe", Some("B"), true),
            ("together", Some("A"), false),
            ("together", None, true)
        ]
    );
}

#[test]
fn a_second_command_for_one_step_is_refused() {
    let team = Team::start(json!({}));
    std::thread::scope(|scope| {
        let (answered, answers) = mpsc::channel();
        for _ in 0..2 {
            let (team, answered) = (&team, answered.clone());
            scope
                .spawn(move || answered.send(team.ask(0, "wait", json!({ "steps": 3 }))).expect("who waits"));
        }
        let refused = answers.recv().expect("one of the two answers at once");
        refused.refused(409, &["robot \"A\" has its command for this step already", "B commands"]);
        team.ask(1, "wait", json!({ "steps": 3 })).ok();
        assert_eq!(answers.recv().expect("the other answer").ok()["step"], 3);
    });
}

#[test]
fn who_waits_is_told_when_the_episode_is_deleted() {
    let team = Team::start(json!({}));
    std::thread::scope(|scope| {
        let (answered, answers) = mpsc::channel();
        for _ in 0..2 {
            let (team, answered) = (&team, answered.clone());
            scope
                .spawn(move || answered.send(team.ask(0, "wait", json!({ "steps": 3 }))).expect("who waits"));
        }
        answers.recv().expect("one of the two answers at once").refused(409, &["already"]);
        team.server.delete(&format!("/v1/episodes/{}", team.id)).ok();
        answers.recv().expect("the other answer").refused(410, &["the episode has stopped"]);
    });
}

#[test]
fn who_keeps_silent_is_held_and_told_so() {
    let team = Team::start(json!({ "patience_s": 0.1 }));
    for step in [5, 10] {
        let reply = team.ask(0, "wait", json!({ "steps": 5 })).ok();
        assert_eq!(reply["partners"], json!([{ "robot": "B", "did": "held_silent" }]));
        assert_eq!(reply["step"], step);
    }
    let late = || team.ask(1, "wait", json!({ "steps": 5 }));
    late().refused(409, &["robot \"B\" was held still from step 0 to 10", "look again"]);
    // From now on the round waits for B, whose next command counts.
    let [a, b] = team.both(("wait", json!({ "steps": 5 })), ("wait", json!({ "steps": 5 })));
    let replies = [a.ok(), b.ok()];
    assert_eq!(replies.map(|reply| reply["step"].clone()), [15, 15]);
    // An observation includes the current step, so no notice is needed.
    team.ask(0, "wait", json!({ "steps": 5 })).ok();
    team.ask(1, "get_robot_state", json!({ "robot": "B" })).ok();
    let [a, b] = team.both(("wait", json!({ "steps": 5 })), ("wait", json!({ "steps": 5 })));
    assert_eq!((a.status, b.status), (200, 200), "{a:?} {b:?}");
    team.verified();
}

#[test]
fn operators_talk_where_they_may() {
    let quiet = Team::start(json!({}));
    quiet.ask(0, "say", json!({ "text": "Hello." })).refused(409, &["talk true"]);
    let team = Team::start(json!({ "talk": true, "patience_s": 0.1 }));
    team.ask(0, "say", json!({ "text": "" })).refused(422, &["text is empty"]);
    let words = ["I lift it.", "Take it by the top."];
    words.iter().for_each(|text| drop(team.ask(0, "say", json!({ "text": text })).ok()));
    let told =
        |(text, number): (&str, u32)| json!({ "from": "A", "text": text, "step": 0, "number": number });
    let heard = [(words[0], 1), (words[1], 2)].map(told);
    let reply = team.ask(1, "wait", json!({ "steps": 2 })).ok();
    assert_eq!(reply["heard"], json!(heard));
    assert!(team.ask(1, "get_status", json!({})).ok().get("heard").is_none(), "once is enough");
    team.ask(1, "say", json!({ "text": "Yes." })).ok();
    let reply = team.ask(0, "say", json!({ "text": "Now." })).ok();
    assert_eq!(reply["heard"][0]["text"], "Yes.", "who speaks hears, too");
    let (path, bearer) = (format!("/v1/episodes/{}/tools", team.id), format!("Bearer {}", team.tokens[0]));
    let (_, _, tools) = team.server.ask("GET", &path, &[("authorization", &bearer)], b"");
    let tools: Value = serde_json::from_slice(&tools).expect("JSON");
    assert!(names(&tools, "name").contains(&"say"), "{tools}");
    let list = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {} });
    let headers = [("authorization", &*bearer), ("accept", "application/json, text/event-stream")];
    let listed = team.server.post_with("/mcp", &headers, &list).ok();
    assert!(names(&listed["result"]["tools"], "name").contains(&"say"), "{listed}");
    let (_, _, tools) = team.server.ask("GET", "/v1/tools", &headers[..1], b"");
    assert!(String::from_utf8_lossy(&tools).contains("\"say\""));
    let (_, _, document) = team.server.ask("GET", "/v1/openapi.json", &headers[..1], b"");
    assert!(String::from_utf8_lossy(&document).contains("/tools/say"));
    team.ask(0, "grasp", json!({})).refused(404, &["no tool \"grasp\"", "finish, say"]);
    let (_, recording) = team.verified();
    let calls = recording.tool_calls().expect("its calls");
    let said: Vec<_> = calls.iter().filter(|call| call.tool == "say").collect();
    assert_eq!((said.len(), said[1].operator.as_deref()), (4, Some("A")));
    assert_eq!(said[1].arguments["text"], words[1]);
}

/// Under the `partner` stress, one robot is silent on every fifth seed: its messages are recorded but not
/// delivered.
#[test]
fn a_silent_partner_is_not_heard() {
    let stress = (Some(StressAxis::Partner), Some(StressLevel::Three));
    let server = || TestServer::with(Layer { stress: stress.0, level: stress.1, ..Layer::default() });
    let heard = |seed: u32| {
        let team = Team::on(server(), seed, json!({ "talk": true, "patience_s": 0.1 }));
        let heard = [0, 1].map(|robot| {
            team.ask(robot, "say", json!({ "text": "I lift it." })).ok();
            names(&team.ask(1 - robot, "get_status", json!({})).ok()["heard"], "from").len()
        });
        let (_, recording) = team.verified();
        let calls = recording.tool_calls().expect("its calls");
        assert_eq!(calls.iter().filter(|call| call.tool == "say").count(), 2);
        heard.iter().sum::<usize>()
    };
    assert_eq!((heard(2004), heard(2000)), (1, 2));
}

#[test]
fn the_episode_ends_when_every_operator_has_finished() {
    let team = Team::start(json!({}));
    let left = team.ask(0, "finish", json!({}));
    assert_eq!((left.status, &left.body["ended"]), (202, &Value::Null));
    team.ask(0, "wait", json!({ "steps": 1 })).refused(409, &["has finished"]);
    let reply = team.ask(1, "wait", json!({ "steps": 4 })).ok();
    assert_eq!(reply["partners"], json!([{ "robot": "A", "did": "held_finished" }]));
    let result = team.ask(1, "finish", json!({})).ok();
    assert_eq!((&result["ended"], &result["env_steps"]), (&json!("finished"), &json!(4)));
    assert_eq!(team.ask(0, "finish", json!({})).ok()["state_hash"], result["state_hash"]);
    let (closed, _) = team.verified();
    assert_eq!(closed["state_hash"], result["state_hash"]);
}

/// Over MCP the token identifies the episode.
#[test]
fn operators_may_speak_mcp() {
    let team = Team::start(json!({ "patience_s": 0.1 }));
    let call = |token: &str, tool: &str, args: Value| {
        let request = json!({
            "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": { "name": tool, "arguments": args },
        });
        let bearer = format!("Bearer {token}");
        let headers = [("authorization", bearer.as_str()), ("accept", "application/json, text/event-stream")];
        let result = team.server.post_with("/mcp", &headers, &request).ok()["result"].clone();
        (result["isError"] == true, result["content"][0]["text"].as_str().expect("text").to_owned())
    };
    let (failed, text) = call(&team.tokens[0], "wait", json!({ "steps": 3, "observe": {} }));
    assert!(!failed && text.contains("held_silent") && !text.contains("png_base64"), "{text}");
    let (failed, text) = call(&team.tokens[0], "get_robot_state", json!({ "robot": "B" }));
    assert!(failed && text.contains("yours is \"A\""), "{text}");
    let (failed, text) = call("nobody-has-this-token", "wait", json!({ "episode_id": team.id, "steps": 1 }));
    assert!(failed && text.contains("driven by its own operator"), "{text}");
    let start = json!({ "task": "handover", "seed": 0 });
    assert!(call(&team.tokens[0], "start_episode", start).0);
    // Tools that would be refused are not listed.
    let offered = |token: &str| {
        let list = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {} });
        let bearer = format!("Bearer {token}");
        let headers = [("authorization", bearer.as_str()), ("accept", "application/json, text/event-stream")];
        let listed = team.server.post_with("/mcp", &headers, &list).ok();
        let (_, _, tools) = team.server.ask("GET", "/v1/tools", &headers[..1], b"");
        let tools: Value = serde_json::from_slice(&tools).expect("JSON");
        [&listed["result"]["tools"], &tools].map(|tools| names(tools, "name").contains(&"start_episode"))
    };
    assert_eq!((offered(&team.tokens[0]), offered("none")), ([false; 2], [true; 2]));
    let prompt = |token: &str| {
        let request = json!({
            "jsonrpc": "2.0", "id": 1, "method": "prompts/get",
            "params": { "name": "play_task", "arguments": { "task": "handover" } },
        });
        let bearer = format!("Bearer {token}");
        let headers = [("authorization", bearer.as_str()), ("accept", "application/json, text/event-stream")];
        team.server.post_with("/mcp", &headers, &request).ok().to_string()
    };
    let text = prompt(&team.tokens[1]);
    assert!(
        text.contains("operator of robot B. Look with observe") && !text.contains("start_episode"),
        "{text}"
    );
    assert!(prompt("none").contains("Begin with start_episode, task handover, seed 0"));
}

#[test]
fn only_who_asks_for_operators_gets_them() {
    let server = TestServer::start();
    let start = |fields: Value| {
        let mut body = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
        body.as_object_mut().expect("an object").extend(fields.as_object().cloned().unwrap_or_default());
        server.post("/v1/episodes", &body)
    };
    assert!(start(json!({ "operators": "one", "talk": null })).ok().get("operators").is_none());
    start(json!({ "operators": "two" })).refused(422, &["per_robot"]);
    start(json!({ "operators": "per_robot", "patience_s": 0 })).refused(422, &["patience_s is 0", "120"]);
    for fields in [json!({ "talk": true }), json!({ "operators": "one", "talk": true })] {
        start(fields)
            .refused(422, &["talk is for operators", "\"operators\": \"per_robot\"", "leave talk out"]);
    }
    start(json!({ "patience_s": 5 })).refused(422, &["patience_s is for operators", "leave patience_s out"]);
    assert_eq!(server.get("/healthz").ok()["episodes"], 1);
}

/// The texts for an operator describe the operator's robot and the permitted calls.
#[test]
fn an_operators_tools_are_its_own() {
    let team = Team::start(json!({ "talk": true }));
    let bearer = format!("Bearer {}", team.tokens[1]);
    for path in ["/v1/tools".to_owned(), format!("/v1/episodes/{}/tools", team.id)] {
        let (_, _, list) = team.server.ask("GET", &path, &[("authorization", &*bearer)], b"");
        let list: Value = serde_json::from_slice(&list).expect("JSON");
        let text = list.to_string();
        assert!(!text.contains("start_episode") && !text.contains("End the episode"), "{path}: {text}");
        assert!(text.contains("your robot holds still from then on"), "{path}: {text}");
    }
    let list = team.server.get(&format!("/v1/episodes/{}/tools", team.id)).ok().to_string();
    assert!(list.contains("End the episode and get its result"), "whoever started it may end it");
    let (_, _, list) = team.server.ask(
        "GET",
        &format!("/v1/episodes/{}/tools", team.id),
        &[("authorization", &*bearer)],
        b"",
    );
    let list = String::from_utf8(list).expect("text");
    assert!(list.contains("^[B]$") && !list.contains("^[AB]$"), "{list}");
}

/// Every list of tools, and every text that mentions tools, includes `say` if and only if the caller may use
/// it.
#[test]
fn who_may_not_talk_is_not_offered_to() {
    let quiet = Team::start(json!({}));
    let talking = Team::start(json!({ "talk": true }));
    let list = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {} });
    let grasp = json!({
        "jsonrpc": "2.0", "id": 1, "method": "tools/call", "params": { "name": "grasp", "arguments": {} },
    });
    // An operator without permission to talk, and a caller that has started an episode whose operators may
    // talk.
    for (team, token) in [(&quiet, quiet.tokens[0].as_str()), (&talking, "none")] {
        let bearer = format!("Bearer {token}");
        let headers = [("authorization", &*bearer), ("accept", "application/json, text/event-stream")];
        let mcp = |body: &Value| team.server.post_with("/mcp", &headers, body).body.to_string();
        let get = |path: &str| {
            let (_, _, bytes) = team.server.ask("GET", path, &headers[..1], b"");
            String::from_utf8(bytes).expect("text")
        };
        let of_episode = format!("/v1/episodes/{}/tools", team.id);
        let refused = team.server.tool_as(token, &team.id, "grasp", &json!({}));
        assert_eq!(refused.status, 404);
        for text in [
            refused.body.to_string(),
            mcp(&list),
            mcp(&grasp),
            get("/v1/tools"),
            get("/v1/tools?format=mcp"),
            get(&of_episode),
            get("/v1/openapi.json"),
        ] {
            let offered = ["\"say\"", "/tools/say", ", say"].iter().find(|name| text.contains(**name));
            assert!(text.contains("move_wrists") && offered.is_none(), "{offered:?} in {text}");
        }
    }
    let said = json!({
        "jsonrpc": "2.0", "id": 1, "method": "tools/call",
        "params": { "name": "say", "arguments": { "episode_id": 5, "text": "Hello." } },
    });
    let bearer = format!("Bearer {}", talking.tokens[0]);
    let headers = [("authorization", &*bearer), ("accept", "application/json, text/event-stream")];
    let answer = talking.server.post_with("/mcp", &headers, &said).body.to_string();
    assert!(answer.contains("episode_id") && !answer.contains("nobody hears you"), "{answer}");
    for args in [json!({}), json!({ "text": "" }), json!({ "text": "Hello." })] {
        quiet.ask(0, "say", args).refused(409, &["nobody hears you"]);
    }
}
