//! Forms of the contract: strict and lenient, for any episode and for a running episode.

use serde_json::{Map, Value, json};
use tandem_tools_spec::{Format, Hints, ToolSpec, Wording, episode_tool_specs, openapi, tool_specs};

/// Returns all texts about tools that a policy reads, one for each form.
fn faces(hints: Hints) -> Vec<String> {
    let specs = tool_specs(hints);
    let mut faces = vec![
        json!(specs),
        json!(episode_tool_specs(hints, "x", &["A".into(), "B".into()], 25, false)),
        openapi("1.2.3", hints, false),
    ];
    for format in Format::ALL {
        faces.push(specs.iter().map(|spec| spec.formatted(format)).collect());
    }
    // Texts in OpenAPI break their lines like the source.
    faces.iter().map(|face| face.to_string().replace("\\n", " ")).collect()
}

/// Recipes for grasping are only in the briefing, which is read once.
#[test]
fn every_face_tells_the_hands_geometry_and_no_recipe() {
    const GEOMETRY: [&str; 3] =
        ["A hand closes on what is 0.12 m along x", "negative ones middle", "palm inwards"];
    for (face, text) in faces(Hints::On).iter().enumerate() {
        for fact in GEOMETRY {
            assert!(text.contains(fact), "face {face} lacks {fact:?}");
        }
        assert!(!text.contains("bottle: ") && !text.contains("most_steps"), "face {face}");
    }
    assert_eq!(faces(Hints::On), faces(Hints::Off), "hints are of the brief alone");
}

/// A policy that directs all robots has no partners that could send messages.
#[test]
fn lists_have_what_is_for_operators_for_operators_alone() {
    let list = |wording: Wording| {
        let specs = tool_specs(wording);
        Format::ALL
            .map(|format| specs.iter().map(|spec| spec.formatted(format)).collect::<Value>().to_string())
    };
    let one = Wording::from(Hints::On);
    for field in ["until_heard", "heard", "heard_from", "partners_wait"] {
        let named = format!("\"{field}\"");
        for (of_one, of_operator) in list(one).iter().zip(list(one.for_operator())) {
            assert!(!of_one.contains(&named) && of_operator.contains(&named), "{field}");
        }
        assert!(
            openapi("1.2.3", one, false).to_string().contains(&named),
            "both send the same bodies: {field}"
        );
    }
}

/// A host sends the list with every request to a model.
#[test]
fn the_list_of_tools_is_small() {
    let tools: Value = tool_specs(Hints::On).iter().map(|spec| spec.formatted(Format::Mcp)).collect();
    let bytes = tools.to_string().len();
    assert!(bytes <= 16_000, "{bytes} bytes");
}

fn spec(name: &str) -> ToolSpec {
    tool_specs(Hints::On).into_iter().find(|spec| spec.name == name).expect("a tool")
}

/// Calls `visit` with every object below `value`, `value` included.
fn for_each_object(value: &Value, visit: &mut impl FnMut(&Map<String, Value>)) {
    match value {
        Value::Array(items) => items.iter().for_each(|item| for_each_object(item, visit)),
        Value::Object(object) => {
            visit(object);
            object.values().for_each(|value| for_each_object(value, visit));
        }
        _ => {}
    }
}

/// Counts the optional fields of all tools, and the fields with a choice of types.
fn optional_and_unions(tools: &Value) -> (usize, usize) {
    let (mut optional, mut unions) = (0, 0);
    for_each_object(tools, &mut |object| {
        if let (Some(Value::Object(all)), Some(Value::Array(required))) =
            (object.get("properties"), object.get("required"))
        {
            optional += all.len() - required.len();
        }
        unions += usize::from(object.contains_key("anyOf"));
    });
    (optional, unions)
}

/// https://platform.claude.com/docs/en/build-with-claude/structured-outputs: at most 20 strict tools, 24
/// optional fields and 16 fields with a union of types, over all tools of a request.
#[test]
fn anthropic_takes_all_tools_at_once() {
    let specs = tool_specs(Hints::On).into_iter().filter(|spec| spec.strict);
    let tools: Value = specs.map(|spec| spec.formatted(Format::Anthropic)).collect();
    let (optional, unions) = optional_and_unions(&tools);
    assert!(tools.as_array().is_some_and(|tools| tools.len() <= 20));
    assert!(optional <= 24 && unions <= 16, "{optional} fields may be left out, {unions} are unions");
}

#[test]
fn a_face_without_null_does_not_speak_of_it() {
    let tools: Value = tool_specs(Hints::On).iter().map(|spec| spec.formatted(Format::Mcp)).collect();
    assert_eq!(optional_and_unions(&tools).1, 0);
    for_each_object(&tools, &mut |object| {
        let text = object.get("description").and_then(Value::as_str).unwrap_or_default();
        assert!(
            !text.to_lowercase().contains("null"),
            "{text:?}: say \"Null: ...\" of a field that may be null"
        );
        assert!(object.get("type").is_none_or(|kind| kind != "null"), "{object:?}");
    });
}

#[test]
fn every_format_has_the_tools_under_their_names() {
    let specs = tool_specs(Hints::On);
    for format in Format::ALL {
        assert_eq!(Format::find(format.name()), Some(format));
        for spec in &specs {
            let tool = spec.formatted(format);
            let tool = if format == Format::OpenAiChat { &tool["function"] } else { &tool };
            assert_eq!(tool["name"], spec.name, "{format:?}");
            // Maximum length that OpenAI accepts.
            assert!(tool["description"].as_str().is_some_and(|text| text.len() <= 1024), "{tool}");
        }
    }
    assert_eq!(Format::find("OpenAI"), None);
    let hints = |name: &str| spec(name).formatted(Format::Mcp)["annotations"].clone();
    let (finish, look) = (hints("finish"), hints("get_status"));
    assert_eq!(finish, json!({ "destructiveHint": false, "idempotentHint": true }));
    assert_eq!(look, json!({ "readOnlyHint": true }));
}

#[test]
fn what_may_be_null_may_be_left_out_but_of_the_strict_schema() {
    let check = |name: &str, place: &str, expected: Value| {
        let lenient = json!(spec(name).lenient_schema());
        assert_eq!(lenient.pointer(place), Some(&expected), "{name}: {lenient}");
    };
    check("query_depth", "/required", json!(["episode_id", "robot"]));
    check("query_depth", "/properties/region/required", json!(["from", "to", "stride"]));
    check("observe", "/required", json!(["episode_id"]));
    check("start_episode", "/required", json!(["task", "seed"]));
    check("move_wrists", "/required", json!(["episode_id", "steps", "robots"]));
    check("move_wrists", "/properties/robots/items/required", json!(["robot"]));
    assert_eq!(
        json!(spec("observe").input_schema)["required"],
        json!(["episode_id", "robots", "short", "frame", "depth_image"])
    );
    let body = |name: &str| spec(name).body_schema(50)["required"].clone();
    assert_eq!((body("query_depth"), body("observe")), (json!(["robot"]), Value::Null));
}

/// Lenient schemas state the defaults of omitted fields; strict hosts refuse defaults.
#[test]
fn what_may_be_left_out_has_its_default() {
    let entry = "/properties/robots/items/properties";
    for (name, place, default) in [
        ("wait", "/properties/short", json!(false)),
        ("observe", "/properties/short", json!(false)),
        ("observe", "/properties/frame", json!("pelvis")),
        ("move_wrists", &format!("{entry}/carried"), json!(false)),
        ("move_wrists", &format!("{entry}/vx_m_s"), json!(0)),
        ("walk_to", &format!("{entry}/carry"), json!(false)),
    ] {
        let spec = spec(name);
        for schema in [json!(spec.lenient_schema()), spec.body_schema(50)] {
            assert_eq!(
                schema.pointer(place).map(|field| &field["default"]),
                Some(&default),
                "{name} {place}"
            );
        }
        assert!(!json!(spec.few_unions_schema()).to_string().contains("\"default\""), "{name}");
    }
}

/// Robots that carry together pass their waypoints together.
#[test]
fn robots_that_carry_have_as_many_waypoints_as_each_other() {
    let call = |carry: bool, counts: [usize; 2]| {
        let entry = |(robot, count): (&str, usize)| {
            let waypoints = vec![json!({ "at_m": [0.1, 0.2] }); count];
            json!({ "robot": robot, "to_m": [0.0, 0.5], "waypoints": waypoints, "carry": carry })
        };
        let robots: Vec<Value> = ["A", "B"].into_iter().zip(counts).map(entry).collect();
        let call = tandem_tools_spec::Call::parse("walk_to", json!({ "steps": 500, "robots": robots }));
        call.err().map(|refusal| refusal.to_string())
    };
    assert_eq!((call(true, [2, 2]), call(false, [1, 2])), (None, None));
    assert!(call(true, [1, 2]).is_some_and(|refusal| refusal.contains("each as many")));
    assert!(call(false, [11, 0]).is_some_and(|refusal| refusal.contains("10 at most")));
}

/// Example arguments fit the schema that their caller sees. They name the episode if the schema does, and
/// contain no null.
#[test]
fn examples_fit_the_schemas() {
    for name in ["check_reach", "move_wrists", "query_depth", "walk_to", "observe"] {
        let refused = tandem_tools_spec::Call::parse(name, json!({ "nothing": 1 })).unwrap_err();
        let named = refused.naming_episode("handover-seed0").to_string();
        let example: Value =
            serde_json::from_str(named.split("arguments that work: ").nth(1).unwrap()).unwrap();
        assert_eq!(example["episode_id"], "handover-seed0", "{named}");
        assert!(!example.to_string().contains("null"), "{named}");
        let schema = json!(spec(name).lenient_schema());
        for field in example.as_object().into_iter().flat_map(Map::keys) {
            assert!(schema["properties"].get(field).is_some(), "{field}: {schema}");
        }
    }
}

#[test]
fn every_tool_names_its_route_and_openapi_has_it() {
    let document = openapi("1.2.3", Hints::On, false);
    for spec in tool_specs(Hints::On) {
        let operation = &document["paths"][&spec.route.path][spec.route.method.to_lowercase()];
        assert_eq!(operation["operationId"], spec.name, "{:?}", spec.route);
    }
    let route = |name: &str| format!("{} {}", spec(name).route.method, spec(name).route.path);
    assert_eq!(route("list_tasks"), "GET /v1/tasks");
    assert_eq!(route("start_episode"), "POST /v1/episodes");
    assert_eq!(route("wait"), "POST /v1/episodes/{episode_id}/tools/wait");
    assert_eq!(json!(spec("wait"))["route"]["path"], "/v1/episodes/{episode_id}/tools/wait");
}

#[test]
fn a_running_episode_says_how_many_steps_a_command_may_have() {
    let specs = episode_tool_specs(Hints::On, "handover-seed0", &["A".into(), "B".into()], 25, false);
    let body = |name: &str| {
        let found = specs.iter().find(|tool| tool.name == name).expect("a tool");
        assert_eq!(found.route.path, format!("/v1/episodes/handover-seed0/tools/{name}"));
        &found.body_schema["properties"]
    };
    for name in ["wait", "walk", "move_wrists"] {
        assert_eq!(body(name)["steps"]["maximum"], 25, "{name}");
    }
    let rows = &body("send_joint_chunk")["robots"]["items"]["properties"]["rows"];
    assert_eq!((&rows["maxItems"], &rows["items"]["maxItems"]), (&json!(25), &json!(35)));
    assert!(specs.iter().all(|tool| tool.name != "list_tasks"));
}

/// A model reads the list of its episode's tools once; validators use OpenAPI.
#[test]
fn the_list_of_an_episode_is_for_a_reader() {
    let specs = episode_tool_specs(Hints::On, "handover-seed0", &["B".into()], 25, true);
    let list = json!(specs);
    let bytes = list.to_string().len();
    assert!(bytes <= 24_000, "{bytes} bytes");
    for_each_object(&list, &mut |object| {
        for keyword in ["input_schema", "not", "anyOf", "prefixItems", "$schema"] {
            assert!(!object.contains_key(keyword), "{keyword} in {object:?}");
        }
        let least = object.get("minimum").and_then(Value::as_f64);
        assert!(least.is_none_or(|least| least > -1e6), "{object:?}");
    });
    let plan = specs.iter().find(|tool| tool.name == "send_plan").expect("plans");
    let command = &plan.body_schema["properties"]["commands"]["items"]["properties"];
    assert_eq!(command["tool"]["enum"].as_array().map(Vec::len), Some(5));
    assert!(
        !command["arguments"].to_string().contains("maximum"),
        "each tool's own schema says it: {command}"
    );
    let walk = specs.iter().find(|tool| tool.name == "walk").expect("walks");
    assert_eq!(walk.body_schema["properties"]["robots"]["maxItems"], 1, "an operator has one robot");
}
