//! Tests of the MCP route from the side of a host: JSON-RPC over HTTP, with images as separate content
//! blocks.

use serde_json::{Value, json};
use tandem::settings::Layer;
use tandem_tests::TestServer;
use tandem_tools_spec::{Format, Hints};

/// Sends one JSON-RPC request without a session.
fn rpc(server: &TestServer, method: &str, params: Value) -> Value {
    let request = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
    server.post("/mcp", &request).ok()["result"].clone()
}

fn call(server: &TestServer, tool: &str, args: Value) -> Value {
    rpc(server, "tools/call", json!({ "name": tool, "arguments": args }))
}

fn text(result: &Value) -> &str {
    result["content"][0]["text"].as_str().expect("a block of text")
}

#[test]
fn tools_are_those_of_the_contract() {
    let server = TestServer::start();
    let listed = rpc(&server, "tools/list", json!({}));
    let tools = listed["tools"].as_array().expect("tools");
    let specs = tandem_tools_spec::tool_specs(Hints::On);
    assert_eq!(tools.len(), specs.len());
    for (tool, spec) in tools.iter().zip(&specs) {
        assert_eq!(*tool, spec.formatted(Format::Mcp));
        assert!(tool.get("outputSchema").is_none(), "clients drop the pictures of such tools: {tool}");
    }
    assert_eq!(listed["tools"], server.get("/v1/tools?format=mcp").ok());
}

#[test]
fn an_episode_can_be_played() {
    let server = TestServer::start();
    let started =
        call(&server, "start_episode", json!({ "task": "handover", "seed": 0, "protocol": "benchmark" }));
    let started: Value = serde_json::from_str(text(&started)).expect("JSON");
    let id = &started["episode_id"];

    let waited = call(&server, "wait", json!({ "episode_id": id, "steps": 2 }));
    let waited: Value = serde_json::from_str(text(&waited)).expect("JSON");
    assert_eq!(waited["executed_steps"], 2);

    let seen = call(&server, "observe", json!({ "episode_id": id, "robots": null }));
    let kinds: Vec<&str> =
        seen["content"].as_array().into_iter().flatten().filter_map(|block| block["type"].as_str()).collect();
    assert_eq!(kinds, ["text", "text", "image", "image"]);
    assert_eq!(seen["content"][1]["text"], "2 images follow. Image 1: A. Image 2: B.");
    assert!(!text(&seen).contains("png_base64"));
    assert!(seen["content"][2]["data"].as_str().is_some_and(|data| data.starts_with("iVBORw0KGgo")));

    let asked = json!({ "episode_id": id, "robots": ["B"], "depth_image": true });
    let seen = call(&server, "observe", asked);
    let caption = seen["content"][1]["text"].as_str().expect("a caption");
    let range = "2 images follow. Image 1: B. Image 2: depth of B, grey linear in 1 / depth, white ";
    assert!(caption.starts_with(range) && caption.ends_with(" m or nothing."), "{caption}");
    assert!(!text(&seen).contains("depth_images"));
    let files = [2, 3].map(|block: usize| seen["content"][block]["data"].as_str().expect("a file"));
    assert!(files[0] != files[1] && files[1].starts_with("iVBORw0KGgo"));
}

/// Returns true if `value` has one of the types of a schema's `type`, or if the schema has none.
fn is_of_type(value: &Value, schema: &Value) -> bool {
    let is = |kind: &Value| match kind.as_str().expect("a type") {
        "null" => value.is_null(),
        "boolean" => value.is_boolean(),
        "integer" => value.is_i64() || value.is_u64(),
        "number" => value.is_number(),
        "string" => value.is_string(),
        "array" => value.is_array(),
        "object" => value.is_object(),
        other => panic!("{other} is no type"),
    };
    match &schema["type"] {
        Value::Null => true,
        Value::Array(kinds) => kinds.iter().any(is),
        kind => is(kind),
    }
}

/// Clients that request it receive schemas of replies, and the replies as values that match them. All other
/// clients receive neither, because a model would read both.
#[test]
fn structured_content_fits_its_schema() {
    let server = TestServer::with(Layer { max_episodes: Some(4), ..Layer::default() });
    let rpc = |path: &str, method: &str, params: Value| {
        let request = json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params });
        server.post(path, &request).ok()["result"].clone()
    };
    let structured = "/mcp?output=structured";
    let listed = rpc(structured, "tools/list", json!({}));
    let schemas = |name: &str| {
        let mut tools = listed["tools"].as_array().into_iter().flatten();
        tools.find(|tool| tool["name"] == name).expect("a tool")["outputSchema"].clone()
    };
    assert!(schemas("observe").is_null());
    let started = json!({ "task": "handover", "seed": 0 });
    let id = server.post("/v1/episodes", &started).ok()["episode_id"].clone();
    let hand = json!({ "robot": "A", "right_position_m": [0.3, -0.2, 0.1] });
    let wait = json!({ "tool": "wait", "arguments": { "steps": 2 } });
    let still = json!({ "robot": "A", "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0 });
    let calls = [
        ("list_tasks", json!({})),
        ("start_episode", started),
        ("get_robot_state", json!({ "robot": "A", "frame": "room" })),
        ("query_depth", json!({ "robot": "A", "pixels": [[160, 120]] })),
        ("query_depth", json!({ "robot": "A", "surface": { "object": "bottle" } })),
        ("check_reach", hand.clone()),
        ("move_wrists", json!({ "steps": 2, "robots": [hand] })),
        ("walk", json!({ "steps": 2, "robots": [still] })),
        ("wait", json!({ "steps": 2 })),
        ("send_plan", json!({ "commands": [wait, wait] })),
        ("walk_to", json!({ "steps": 5, "robots": [{ "robot": "A", "to_m": [-0.2, 0.0] }] })),
        ("get_status", json!({ "explain": true })),
        ("finish", json!({})),
    ];
    for (name, mut args) in calls {
        for short in [true, false] {
            args["short"] = short.into();
            if !["list_tasks", "start_episode"].contains(&name) {
                args["episode_id"] = id.clone();
            }
            let ask = |path: &str| rpc(path, "tools/call", json!({ "name": name, "arguments": args }));
            let reply = ask(structured);
            let (value, schema) = (&reply["structuredContent"], schemas(name));
            assert_eq!(*value, serde_json::from_str::<Value>(text(&reply)).expect("JSON"), "{name}");
            for required in schema["required"].as_array().into_iter().flatten() {
                assert!(value.get(required.as_str().expect("a name")).is_some(), "{name}: {required}");
            }
            for (field, value) in value.as_object().expect("an object") {
                let kind = &schema["properties"][field];
                assert!(is_of_type(value, kind), "{name}.{field} is {value}, not {kind}");
            }
            let is_read = ["list_tasks", "get_robot_state", "finish"].contains(&name);
            assert!(!is_read || ask("/mcp").get("structuredContent").is_none(), "{name}");
        }
    }
    let seen = json!({ "name": "observe", "arguments": { "episode_id": id, "robots": ["A"] } });
    let seen = rpc(structured, "tools/call", seen);
    assert!(seen.get("structuredContent").is_none() && seen["content"][2]["type"] == "image");
}

/// Images may be sent as links, over HTTP and MCP, to the callers who may see them inline.
#[test]
fn images_may_be_links() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    let inline = server.tool(&id, "observe", &json!({})).ok();
    let linked = server.tool(&id, "observe", &json!({ "images": "link" })).ok();
    assert!(linked.get("images").is_none() && linked["cameras"] == inline["cameras"], "{linked}");
    let get = |path: &str, token: &str| {
        let bearer = format!("Bearer {token}");
        let headers: &[(&str, &str)] = if token.is_empty() { &[] } else { &[("authorization", &bearer)] };
        server.ask("GET", path, headers, b"")
    };
    let path = linked["links"][1]["path"].as_str().expect("a path");
    let (status, headers, png) = get(path, "");
    assert_eq!((status, headers["content-type"].to_str().expect("a text")), (200, "image/png"));
    assert_eq!(json!(tandem_tools_spec::Png(png)), inline["images"][1]["png_base64"]);
    server.get(&format!("/v1/episodes/{id}/images/7-A.png")).refused(404, &["7-A.png", "observe again"]);

    let asked = json!({ "episode_id": id, "robots": ["B"], "images": "link" });
    let seen = call(&server, "observe", asked);
    let link = &seen["content"][1];
    assert_eq!((&link["type"], &link["mimeType"]), (&json!("resource_link"), &json!("image/png")), "{seen}");
    let read = rpc(&server, "resources/read", json!({ "uri": link["uri"] }));
    assert_eq!(read["contents"][0]["blob"], inline["images"][1]["png_base64"]);

    let start = json!({ "task": "handover", "seed": 0, "operators": "per_robot" });
    let started = server.post("/v1/episodes", &start).ok();
    let token = |robot: usize| started["operators"][robot]["token"].as_str().expect("a token");
    let id = started["episode_id"].as_str().expect("an id");
    let seen = server.tool_as(token(0), id, "observe", &json!({ "images": "link" })).ok();
    let path = seen["links"][0]["path"].as_str().expect("a path");
    assert_eq!((get(path, token(0)).0, get(path, token(1)).0), (200, 404));
}

/// JSON readers differ in which of two fields with the same name they use, so duplicates are refused.
#[test]
fn fields_that_stand_there_twice_are_refused() {
    let server = TestServer::start();
    let id = server.episode("benchmark");
    for (once, twice) in [
        (r#""steps": 1"#, r#""steps": 1, "steps": 2"#),
        (
            r#""robots": [{"robot": "A"}], "steps": 1"#,
            r#""robots": [{"robot": "A", "robot": "B"}], "steps": 1"#,
        ),
    ] {
        let tool = if once.contains("robots") { "move_wrists" } else { "wait" };
        let ask = |args: &str| {
            let body = format!(
                r#"{{"jsonrpc": "2.0", "id": 1, "method": "tools/call",
                "params": {{"name": "{tool}", "arguments": {{"episode_id": "{id}", {args}}}}}}}"#
            );
            server.send("POST", "/mcp", Some("application/json"), body.as_bytes()).ok()["result"].clone()
        };
        let before = server.get(&format!("/v1/episodes/{id}")).ok();
        let refused = ask(twice);
        assert_eq!(refused["isError"], true, "{refused}");
        assert!(text(&refused).contains("stands there twice"), "{refused}");
        assert_eq!(server.get(&format!("/v1/episodes/{id}")).ok(), before);
        assert_ne!(ask(once)["isError"], true, "{once}");
    }
}

#[test]
fn refusals_are_answers_that_a_model_can_read() {
    let server = TestServer::start();
    for (tool, args, says) in [
        ("wait", json!({ "steps": 3 }), "wait needs episode_id"),
        ("wait", json!({ "steps": 3, "episode_id": "nope" }), "no episode \"nope\""),
        ("wait", json!({ "steps": 0, "episode_id": "nope" }), "at least 1"),
        ("start_episode", json!({ "task": "handove", "seed": 0 }), "have: handover"),
    ] {
        let result = call(&server, tool, args);
        assert_eq!(result["isError"], true, "{result}");
        assert!(text(&result).contains(says), "{result}");
    }
}

#[test]
fn a_prompt_tells_what_has_to_be_known_of_a_task() {
    let server = TestServer::start();
    let listed = rpc(&server, "prompts/list", json!({}));
    let prompt = &listed["prompts"][0];
    assert_eq!(prompt["arguments"][0]["name"], "task", "{listed}");
    let arguments = json!({ "task": "handover", "seed": "7" });
    let told = rpc(&server, "prompts/get", json!({ "name": prompt["name"], "arguments": arguments }));
    let told = told["messages"][0]["content"]["text"].as_str().expect("a text");
    let tasks = server.get("/v1/tasks").ok();
    let task = &tasks["tasks"][0];
    for part in [&task["instruction"], &task["robots"][1]["instruction"], &task["phases"][2]["description"]] {
        assert!(told.contains(part.as_str().expect("a text")), "{told:?} lacks {part}");
    }
    for part in ["pelvis frame", "6000 control steps", "1800 s", "task handover, seed 7, protocol agentic"] {
        assert!(told.contains(part), "{told:?} lacks {part:?}");
    }
}

#[test]
fn what_is_no_call_is_refused_with_the_codes_of_json_rpc() {
    let server = TestServer::start();
    let check = |body: &str, code: i32, says: &str| {
        let answer = server.send("POST", "/mcp", Some("application/json"), body.as_bytes());
        assert_eq!(answer.body["error"]["code"], code, "{body}: {answer:?}");
        let message = answer.body["error"]["message"].as_str().unwrap_or_default();
        assert!(message.contains(says), "{body}: {message:?}");
        assert_eq!(answer.header("content-type"), "application/json", "{body}");
    };
    let ask = |method: &str, params: Value| {
        json!({ "jsonrpc": "2.0", "id": 1, "method": method, "params": params }).to_string()
    };
    check("{", -32700, "no JSON");
    check("[]", -32600, "batches");
    check(&ask("tools/shout", json!({})), -32601, "tools/shout");
    check(&ask("tools/call", json!({})), -32602, "params.name");
    check(&ask("tools/call", json!({ "name": "grasp" })), -32602, "have: list_tasks, start_episode, observe");
    check(&ask("prompts/get", json!({ "name": "nod" })), -32602, "no prompt \"nod\"; have: play_task");
    let of_task =
        |arguments: Value| ask("prompts/get", json!({ "name": "play_task", "arguments": arguments }));
    check(&of_task(json!({})), -32602, "missing field `task`");
    check(&of_task(json!({ "task": "handove" })), -32602, "have: handover");
    check(&of_task(json!({ "task": "handover", "seed": "x" })), -32602, "give one as 0");
}

/// The instructions for a host describe the caller's abilities. An operator's episode has already
/// started, and the operator cannot start another.
#[test]
fn instructions_say_what_the_caller_can_do() {
    let server = TestServer::start();
    let start = json!({ "task": "handover", "seed": 0, "operators": "per_robot" });
    let started = server.post("/v1/episodes", &start).ok();
    let (id, token) = (&started["episode_id"], started["operators"][1]["token"].as_str().expect("a token"));
    let bearer = format!("Bearer {token}");
    let instructions = |headers: &[(&str, &str)]| {
        let client = json!({ "name": "test", "version": "1" });
        let params = json!({ "protocolVersion": "2025-06-18", "capabilities": {}, "clientInfo": client });
        let message = json!({ "jsonrpc": "2.0", "id": 1, "method": "initialize", "params": params });
        let accept = [("accept", "application/json, text/event-stream")];
        let answer = server.post_with("/mcp", &[&accept, headers].concat(), &message).ok();
        answer["result"]["instructions"].as_str().expect("instructions").to_owned()
    };
    let (host, operator) = (instructions(&[]), instructions(&[("authorization", &bearer)]));
    assert!(
        host.contains("Call start_episode, whose tasks list_tasks names, then look with observe"),
        "{host}"
    );
    assert!(!operator.contains("start_episode") && !operator.contains("list_tasks"), "{operator}");
    let id = id.as_str().expect("an id");
    assert!(
        operator.contains(&format!("operator of robot B in the episode {id}, which has begun")),
        "{operator}"
    );
}

#[test]
fn a_client_that_takes_anything_is_answered() {
    let server = TestServer::start();
    let list = json!({ "jsonrpc": "2.0", "id": 1, "method": "tools/list", "params": {} }).to_string();
    for accept in
        ["*/*", "application/json", "application/*;q=0.8, text/html", "application/json, text/event-stream"]
    {
        let headers = [("content-type", "application/json"), ("accept", accept)];
        let (status, _, bytes) = server.ask("POST", "/mcp", &headers, list.as_bytes());
        let answer: Value = serde_json::from_slice(&bytes).unwrap_or_default();
        assert!(status == 200 && answer["result"]["tools"].is_array(), "{accept}: {status} {answer}");
    }
    let headers = [("content-type", "application/json"), ("accept", "text/html")];
    assert_eq!(server.ask("POST", "/mcp", &headers, list.as_bytes()).0, 406);
}
