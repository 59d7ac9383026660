//! Tests of assistance in all texts that reach a policy: replies over REST and MCP, replies to operators,
//! observations after commands, briefs, prompts, and the texts of tools. These contain only the benchmark's
//! information, or all information.

use serde_json::{Value, json};
use tandem::settings::Layer;
use tandem_tests::TestServer;
use tandem_tools_spec::{Assistance, Format};

/// Fields that occur only under `full`.
const FULL_FIELDS: [&str; 12] = [
    "joint_velocities_rad_s",
    "joint_torques_n_m",
    "gravity_in_pelvis",
    "pelvis_in_start",
    "base_motion",
    "fallen",
    "force_n",
    "largest_effort",
    "state",
    "odometry",
    "grasping",
    // Field of a task about its scoring.
    "collaborative",
];

/// Words about information given only under `full`.
const FULL_WORDS: [&str; 8] = [
    "torques",
    "fallen",
    "phases reached",
    "phases they are scored",
    "phases that are scored",
    "pelvis_in_start",
    "is blocked",
    "close to close_rad",
];

fn server(assistance: Assistance) -> TestServer {
    TestServer::with(Layer { assistance: Some(assistance), ..Layer::default() })
}

/// Returns the fields of [`FULL_FIELDS`] that occur anywhere in a reply.
fn full_fields(reply: &Value) -> Vec<&'static str> {
    let mut found: Vec<&'static str> = match reply {
        Value::Object(object) => {
            let own = FULL_FIELDS.into_iter().filter(|field| object.contains_key(*field));
            // A result lists the information that was given, with counts.
            let inner = object.iter().filter(|(name, _)| *name != "extra_information_replies");
            own.chain(inner.flat_map(|(_, value)| full_fields(value))).collect()
        }
        Value::Array(items) => items.iter().flat_map(full_fields).collect(),
        Value::Null | Value::Bool(_) | Value::Number(_) | Value::String(_) => Vec::new(),
    };
    found.sort_unstable();
    found.dedup();
    found
}

fn rpc(server: &TestServer, method: &str, params: Value) -> Value {
    let message = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
    server.post("/mcp", &message).ok()["result"].clone()
}

/// Returns a tool's reply over MCP, as JSON.
fn over_mcp(server: &TestServer, tool: &str, args: Value) -> Value {
    let called = rpc(server, "tools/call", json!({ "name": tool, "arguments": args }));
    let text = called["content"][0]["text"].as_str().unwrap_or_else(|| panic!("no text: {called}"));
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

/// Returns every kind of reply with its fields and the way in which it was obtained.
fn replies(server: &TestServer) -> Vec<(&'static str, Value)> {
    let start = json!({ "task": "handover", "seed": 0, "protocol": "benchmark" });
    let started = server.post("/v1/episodes", &start).ok();
    let id = started["episode_id"].as_str().expect("an id").to_owned();
    let mut per_robot = start;
    per_robot["operators"] = json!("per_robot");
    per_robot["patience_s"] = json!(0.05);
    per_robot["talk"] = json!(true);
    let team = server.post("/v1/episodes", &per_robot).ok();
    let team_id = team["episode_id"].as_str().expect("an id").to_owned();
    let token = team["operators"][0]["token"].as_str().expect("a token").to_owned();
    let of_team = |tool: &str, args: Value| server.tool_as(&token, &team_id, tool, &args).ok();
    let path = format!("/v1/episodes/{id}");
    let looking = json!({ "steps": 1, "observe": { "depth": "png16" } });
    vec![
        ("the list of tasks", server.get("/v1/tasks").ok()),
        ("the list of tasks over MCP", over_mcp(server, "list_tasks", json!({ "short": false }))),
        ("the start", started),
        ("the briefing", server.get(&format!("{path}/briefing")).ok()),
        ("the status", server.get(&path).ok()),
        ("a command that looks", server.tool(&id, "wait", &looking).ok()),
        ("a look", server.tool(&id, "observe", &json!({ "short": false, "images": "rgb" })).ok()),
        (
            "a command over MCP",
            over_mcp(server, "wait", json!({ "episode_id": id, "steps": 1, "short": false })),
        ),
        ("a look over MCP", over_mcp(server, "observe", json!({ "episode_id": id, "short": false }))),
        (
            "a state over MCP",
            over_mcp(server, "get_robot_state", json!({ "episode_id": id, "robot": "A", "short": false })),
        ),
        ("an operator's command", of_team("wait", json!({ "steps": 1, "observe": {} }))),
        ("an operator's look", of_team("observe", json!({ "robots": ["A"] }))),
        ("an operator's words", of_team("say", json!({ "text": "hello" }))),
        ("the list of episodes", server.get("/v1/episodes").ok()),
        ("the end", server.tool(&id, "finish", &json!({})).ok()),
        ("a look after the end", server.tool(&id, "observe", &json!({})).ok()),
        ("the result", server.delete(&path).ok()),
    ]
}

/// Returns every text written for models, and where it appears.
fn texts(server: &TestServer) -> Vec<(String, String)> {
    let id = server.episode("agentic");
    let mut texts: Vec<(String, String)> = Format::ALL
        .into_iter()
        .map(|format| format!("/v1/tools?format={}", format.name()))
        .chain(["/v1/tools".into(), format!("/v1/episodes/{id}/tools")])
        .map(|path| (path.clone(), server.get(&path).ok().to_string()))
        .collect();
    texts.push(("tools over MCP".into(), rpc(server, "tools/list", json!({})).to_string()));
    let play = json!({ "name": "play_task", "arguments": { "task": "pouring" } });
    texts.push(("the prompt".into(), rpc(server, "prompts/get", play).to_string()));
    let briefing = server.get(&format!("/v1/episodes/{id}/briefing")).ok();
    texts.push(("the brief".into(), briefing["brief"].to_string()));
    texts
}

#[test]
fn replies_tell_nothing_beyond_the_assistance() {
    let paper = server(Assistance::Paper);
    for (way, reply) in replies(&paper) {
        assert_eq!(full_fields(&reply), [""; 0], "{way}: {reply}");
    }
    let full = server(Assistance::Full);
    let told: Vec<(&str, Vec<&str>)> =
        replies(&full).into_iter().map(|(way, reply)| (way, full_fields(&reply))).collect();
    // The fields withheld under `paper` are present otherwise.
    for field in FULL_FIELDS {
        assert!(told.iter().any(|(_, fields)| fields.contains(&field)), "{field} is in no reply: {told:?}");
    }
    for (way, fields) in &told {
        let plain = ["the list of episodes", "the end", "the result"].contains(way);
        assert_eq!(fields.is_empty(), plain, "{way}: {fields:?}");
    }
}

#[test]
fn texts_speak_of_nothing_that_is_not_told() {
    let spoken = |texts: Vec<(String, String)>| -> Vec<(String, &'static str)> {
        let words = |(place, text): (String, String)| {
            let found = FULL_WORDS.into_iter().filter(move |word| text.contains(word));
            found.map(|word| (place.clone(), word)).collect::<Vec<_>>()
        };
        texts.into_iter().flat_map(words).collect()
    };
    assert_eq!(spoken(texts(&server(Assistance::Paper))), []);
    let full = spoken(texts(&server(Assistance::Full)));
    for word in FULL_WORDS {
        assert!(full.iter().any(|(_, found)| *found == word), "{word} is in no text: {full:?}");
    }
}

#[test]
fn starts_and_results_say_what_is_told() {
    for assistance in Assistance::ALL {
        let server = server(assistance);
        let id = server.episode("agentic");
        let status = server.get(&format!("/v1/episodes/{id}")).ok();
        assert_eq!((&status["assistance"], status.get("disclosure")), (&json!(assistance), None));
        server.tool(&id, "wait", &json!({ "steps": 1 })).ok();
        let result = server.delete(&format!("/v1/episodes/{id}")).ok();
        assert_eq!(result["assistance"], json!(assistance));
        let own = ["controller: Tandem's own", "instructions: Tandem's own"];
        let (departures, shown) = match assistance {
            Assistance::Paper => (json!(own), Value::Null),
            Assistance::Full => (
                json!([own[0], own[1], "assistance: full"]),
                json!({
                    "joint_torques": { "A": 1, "B": 1 },
                    "hand_forces": { "A": 1, "B": 1 },
                    "odometry": { "A": 1, "B": 1 },
                }),
            ),
        };
        assert_eq!((&result["departures"], &result["extra_information_replies"]), (&departures, &shown));
    }
}
