//! The contract for its two kinds of readers: strict hosts read the schemas, policies read the refusals.

use serde_json::{Value, json};
use tandem_tools_spec::{
    ActCall, EPISODE_TOOLS, Hints, LookCall, SendJointDrives, SendPlan, TalkCall, Tool as _, ToolCall,
    episode_tool_specs, operator_tool_specs, tool_specs,
};

const REFUSED_KEYWORDS: &[&str] = &[
    "$ref",
    "$schema",
    "default",
    "format",
    "maxItems",
    "maximum",
    "minItems",
    "minimum",
    "title",
    "pattern",
    "contains",
    "not",
    "prefixItems",
    "uniqueItems",
    "allOf",
    "oneOf",
];

/// Calls `visit` with `schema` and every object schema below it.
fn for_each_schema(schema: &Value, visit: &mut impl FnMut(&Value)) {
    visit(schema);
    for property in schema["properties"].as_object().into_iter().flat_map(|object| object.values()) {
        for_each_schema(property, visit);
    }
    if schema["items"].is_object() {
        for_each_schema(&schema["items"], visit);
    }
    for option in schema["anyOf"].as_array().into_iter().flatten() {
        for_each_schema(option, visit);
    }
}

#[test]
fn schemas_are_strict() {
    for spec in tool_specs(Hints::On) {
        assert!(spec.description.len() > 40, "{} needs a description", spec.name);
        assert_eq!(
            spec.on_episode,
            spec.input_schema["properties"].get("episode_id").is_some(),
            "{}",
            spec.name
        );
        if !spec.strict {
            continue;
        }
        for_each_schema(&json!(spec.input_schema), &mut |schema| {
            for keyword in REFUSED_KEYWORDS {
                assert!(schema.get(*keyword).is_none(), "{}: {keyword} in {schema}", spec.name);
            }
            assert!(!schema["type"].is_array(), "{}: two types in {schema}", spec.name);
            let Some(properties) = schema["properties"].as_object() else {
                return;
            };
            assert_eq!(schema["additionalProperties"], json!(false), "{}", spec.name);
            let required: Vec<&str> =
                schema["required"].as_array().into_iter().flatten().filter_map(Value::as_str).collect();
            for (name, property) in properties {
                assert!(required.contains(&name.as_str()), "{}: {name} is optional", spec.name);
                assert!(property["description"].is_string(), "{}: {name} has no description", spec.name);
            }
            assert_eq!(required.len(), properties.len(), "{}", spec.name);
        });
    }
}

#[test]
fn the_two_lists_name_the_same_tools() {
    let specs = operator_tool_specs(Hints::On);
    let on_episode: Vec<&str> = specs.iter().filter(|spec| spec.on_episode).map(|spec| spec.name).collect();
    let for_models = |tools: &[&'static str]| -> Vec<&str> {
        tools.iter().copied().filter(|tool| *tool != SendJointDrives::NAME).collect()
    };
    assert_eq!(
        on_episode,
        for_models(EPISODE_TOOLS),
        "operators who talk are offered every tool but those for programs"
    );
    let talks: Vec<&str> = TalkCall::TOOLS.to_vec();
    let of_all: Vec<&str> =
        tool_specs(Hints::On).iter().filter(|spec| spec.on_episode).map(|spec| spec.name).collect();
    assert_eq!([of_all, talks].concat(), on_episode, "others cannot talk");
    let planned = [for_models(ActCall::TOOLS), vec!["walk_to"]].concat();
    assert_eq!(planned, SendPlan::COMMANDS);
}

#[test]
fn calls_survive_the_wire() {
    let calls = [
        ("observe", json!({ "robots": null, "short": true, "frame": null })),
        ("get_robot_state", json!({ "robot": "B" })),
        (
            "query_depth",
            json!({ "robot": "A", "pixels": [[0, 0], [319, 239]], "region": null, "surface": null, "frame": "level" }),
        ),
        ("wait", json!({ "steps": 25 })),
        ("get_status", json!({})),
        ("finish", json!({})),
    ];
    for (name, args) in calls {
        let call = ToolCall::parse(name, args.clone()).unwrap();
        assert_eq!((call.name(), json!(call)), (name, args));
    }
}

#[test]
fn nullable_fields_may_be_left_out() {
    let brief = json!({ "steps": 5, "robots": [{ "robot": "A", "left_position_m": [0.3, 0.2, 0.1] }] });
    let ToolCall::Act(ActCall::MoveWrists(call)) = ToolCall::parse("move_wrists", brief).unwrap() else {
        panic!()
    };
    assert_eq!(call.robots[0].left_position_m, Some([0.3, 0.2, 0.1]));
    assert_eq!(call.robots[0].right_position_m, None);
    assert!(ToolCall::parse("observe", json!({})).is_ok());
}

/// Checks that a refusal contains every text in `says`.
fn refused(name: &str, args: Value, says: &[&str]) {
    let text = match ToolCall::parse(name, args.clone()) {
        Ok(call) => panic!("{name} {args} was accepted: {call:?}"),
        Err(error) => error.to_string(),
    };
    for part in says {
        assert!(text.contains(part), "{name} {args}: {text:?} does not say {part:?}");
    }
}

#[test]
fn refusals_say_what_would_work() {
    let chunk = |rows: Value| json!({ "robots": [{ "robot": "A", "rows": rows }] });
    let row = |columns: usize| json!(vec![0.5; columns]);
    refused("grasp", json!({}), &["\"grasp\"", "observe", "move_wrists", "finish"]);
    refused("start_episode", json!({}), &["start_episode", "observe"]);
    refused("wait", json!({ "steps": 0 }), &["steps is 0", "at least 1"]);
    let expects = json!({ "force_below_n": 2e6 });
    let heavy = json!({ "commands": [{ "tool": "wait", "arguments": { "steps": 1 }, "expects": expects }] });
    refused("send_plan", heavy, &["command 1 of 1: expects.force_below_n holds 2000000"]);
    refused("wait", json!({ "steps": -1 }), &["wait: steps: ", "-1", "{\"steps\":25}"]);
    refused("wait", json!({ "steps": 2.5 }), &["2.5", "{\"steps\":25}"]);
    refused("wait", json!({ "step": 25 }), &["unknown field `step`", "`steps`"]);
    refused("wait", json!({}), &["missing field `steps`"]);
    refused("wait", json!([5]), &["wait: ", "sequence, expected an object", "{\"steps\":25}"]);
    refused("observe", Value::Null, &["observe: ", "null, expected an object"]);
    refused("walk", json!({ "steps": 5, "robots": [["A", 0, 0, 0, null]] }), &["robots[0]: ", "an object"]);
    refused(
        "send_joint_chunk",
        chunk(json!([row(35), row(34)])),
        &["row 1 holds 34", "35: left_arm 7, right_arm 7"],
    );
    refused("send_joint_chunk", chunk(json!([])), &["no rows", "at least 1"]);
    refused(
        "send_joint_chunk",
        json!({ "robots": [{ "robot": "A", "rows": [row(35)] }, { "robot": "B", "rows": [row(35), row(35)] }] }),
        &["same number of rows"],
    );
    let driven = |rows: Value| json!({ "robots": [{ "robot": "A", "rows": rows }] });
    assert!(ToolCall::parse("send_joint_drives", driven(json!([row(215), row(860)]))).is_ok());
    refused(
        "send_joint_drives",
        driven(json!([row(214)])),
        &["row 0 holds 214", "215: position_rad 43", "torque_n_m 43, or 860"],
    );
    let mut negative = vec![0.0; 215];
    negative[2 * 43] = -1.0;
    refused(
        "send_joint_drives",
        driven(json!([negative])),
        &["row 0 has the gain -1", "must not be negative"],
    );
    refused("check_reach", json!({ "robot": "A" }), &["no pose", "right_position_m"]);
    let pixels = |count: usize| json!({ "robot": "A", "pixels": vec![[160, 120]; count] });
    assert!(ToolCall::parse("query_depth", pixels(4096)).is_ok());
    refused("query_depth", pixels(4097), &["4097", "at most 4096"]);
    refused("query_depth", json!({ "robot": "A" }), &["either pixels", "or region"]);
    let both =
        json!({ "robot": "A", "pixels": [[0, 0]], "region": { "from": [0, 0], "to": [1, 1], "stride": 1 } });
    refused("query_depth", both, &["either pixels", "or region"]);
    refused("query_depth", json!({ "robot": "A", "pixels": [] }), &["pixels is empty", "[[160, 120]]"]);
    refused(
        "walk",
        json!({ "steps": 5, "robots": [{ "robot": "A", "vx_m_s": 0.1 }] }),
        &["missing field `vy_m_s`", "yaw_rate_rad_s"],
    );
}

#[test]
fn refusals_of_wrist_poses_name_the_robot_and_the_field() {
    let wrist = |field: &str, value: Value| json!({ "steps": 5, "robots": [{ "robot": "A", field: value }] });
    refused(
        "move_wrists",
        wrist("left_quaternion_wxyz", json!([0, 0, 0, 0])),
        &["robot \"A\"", "left_quaternion_wxyz", "[1, 0, 0, 0]"],
    );
    refused(
        "move_wrists",
        wrist("left_position_m", json!([0.1, 0.2])),
        &["robots[0].left_position_m", "array of length 3"],
    );
    refused("move_wrists", wrist("right_position_m", json!([1e300, 0, 0])), &["right_position_m", "finite"]);
    refused(
        "move_wrists",
        wrist("right_position_m", json!([null, 0, 0])),
        &["robots[0].right_position_m[0]", "null"],
    );
    refused(
        "move_wrists",
        wrist("left_fingers_rad", json!([0, 0, 0, 0, 0, 0])),
        &["left_fingers_rad", "length 7"],
    );
    refused("move_wrists", json!({ "steps": 5, "robots": [] }), &["robots is empty", "\"A\""]);
    refused(
        "move_wrists",
        json!({ "steps": 5, "robots": [{ "robot": "A" }, { "robot": "A" }] }),
        &["named twice"],
    );
    refused(
        "check_reach",
        json!({ "robot": "A", "right_quaternion_wxyz": [0, 0, 0, 0] }),
        &["right_quaternion_wxyz", "norm 0"],
    );
}

#[test]
fn numbers_that_json_cannot_hold_are_refused_too() {
    for number in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let ToolCall::Act(ActCall::Walk(mut walk)) =
            ToolCall::parse("walk", json!({ "steps": 5, "robots": [{ "robot": "A", "vx_m_s": 0, "vy_m_s": 0, "yaw_rate_rad_s": 0 }] })).unwrap()
        else {
            panic!()
        };
        walk.robots[0].vy_m_s = number;
        let text = ToolCall::from(walk).validate().unwrap_err().to_string();
        assert!(text.contains("vy_m_s") && text.contains("finite"), "{text}");
    }
}

#[test]
fn openapi_has_a_path_for_every_tool() {
    let document = tandem_tools_spec::openapi("1.2.3", Hints::On, false);
    assert_eq!((&document["openapi"], &document["info"]["version"]), (&json!("3.1.0"), &json!("1.2.3")));
    for tool in EPISODE_TOOLS.iter().filter(|tool| !TalkCall::TOOLS.contains(tool)) {
        let call = &document["paths"][format!("/v1/episodes/{{episode_id}}/tools/{tool}")]["post"];
        assert_eq!(call["operationId"], *tool);
        let schema = &call["requestBody"]["content"]["application/json"]["schema"];
        assert!(schema["properties"].get("episode_id").is_none(), "{tool}: {schema}");
        assert_eq!(schema["additionalProperties"], false, "{tool}: {schema}");
        assert!(
            call["responses"]["200"]["content"]["application/json"]["schema"]["type"] == "object",
            "{tool}"
        );
    }
    let start = &document["paths"]["/v1/episodes"]["post"];
    assert!(
        start["responses"]["201"]["content"]["application/json"]["schema"]["properties"]["episode_id"]
            .is_object()
    );
}

#[test]
fn a_region_names_every_so_many_pixels_row_by_row() {
    let region = |from: [i64; 2], to: [i64; 2], stride: i64| json!({ "robot": "A", "region": { "from": from, "to": to, "stride": stride } });
    let named = |args: Value| match ToolCall::parse("query_depth", args).unwrap() {
        ToolCall::Look(LookCall::QueryDepth(call)) => call.named(),
        other => panic!("{other:?}"),
    };
    assert_eq!(
        named(region([10, 20], [31, 30], 10)),
        [[10, 20], [20, 20], [30, 20], [10, 30], [20, 30], [30, 30]]
    );
    assert_eq!(named(region([5, 7], [5, 7], 1)), [[5, 7]]);
    assert_eq!(named(region([3, 9], [1, 9], 2)), [[1, 9], [3, 9]], "either corner may come first");
    assert_eq!(named(region([0, 0], [63, 63], 1)).len(), 4096);
    refused(
        "query_depth",
        region([0, 0], [64, 63], 1),
        &["names 4160", "at most 4096", "with stride 2 it fits"],
    );
    refused("query_depth", region([0, 0], [319, 239], 4), &["names 4800", "with stride 5 it fits"]);
    refused("query_depth", region([i64::MIN, i64::MIN], [i64::MAX, i64::MAX], 1), &["at most 4096"]);
    refused("query_depth", region([0, 0], [3, 3], 0), &["stride is 0", "at least 1"]);
    refused("query_depth", region([0, 0], [3, 3], -1), &["region.stride"]);
}

/// A body that the checks refuse is not allowed by its schema.
#[test]
fn openapi_says_what_is_refused() {
    let document = tandem_tools_spec::openapi("1.2.3", Hints::On, false);
    let field = |tool: &str, pointer: &str| {
        let body =
            &document["paths"][format!("/v1/episodes/{{episode_id}}/tools/{tool}")]["post"]["requestBody"];
        let schema = &body["content"]["application/json"]["schema"]["properties"];
        schema.pointer(pointer).unwrap_or_else(|| panic!("{tool} has no {pointer}: {schema}")).clone()
    };
    for tool in ["move_wrists", "walk", "send_joint_chunk"] {
        assert_eq!((field(tool, "/robots/minItems"), field(tool, "/robots/maxItems")), (json!(1), json!(3)));
        let twice = json!({ "properties": { "robot": { "const": "A" } } });
        let not = json!({ "prefixItems": [twice, twice], "minItems": 2 });
        assert_eq!(field(tool, "/robots/not/anyOf/0"), not);
        assert_eq!(field(tool, "/robots/items/properties/robot/pattern"), "^[ABC]$");
    }
    for tool in ["move_wrists", "walk", "wait"] {
        assert_eq!((field(tool, "/steps/minimum"), field(tool, "/steps/maximum")), (json!(1), json!(50)));
    }
    let quaternion = field("check_reach", "/left_quaternion_wxyz");
    assert_eq!(quaternion["contains"], json!({ "anyOf": [{ "minimum": 1e-6 }, { "maximum": -1e-6 }] }));
    assert_eq!((&quaternion["minItems"], &quaternion["maxItems"]), (&json!(4), &json!(4)));
    assert_eq!(field("walk", "/robots/items/properties/vx_m_s/maximum"), 1e6);
    for (soft, least) in
        [("compliance_n_s_m", 50.0), ("side_compliance_n_s_m", 50.0), ("turn_compliance_n_m_s_rad", 5.0)]
    {
        assert_eq!(field("move_wrists", &format!("/robots/items/properties/{soft}/minimum")), least);
    }
    assert_eq!(field("query_depth", "/region/properties/stride/maximum"), u32::MAX);
    assert_eq!(field("send_joint_chunk", "/robots/items/properties/rows/items/items/minimum"), -1e6);
    assert_eq!(field("query_depth", "/pixels/items/prefixItems/1/maximum"), 239);
    let whole = |tool: &str| {
        let path = &document["paths"][format!("/v1/episodes/{{episode_id}}/tools/{tool}")]["post"];
        path["requestBody"]["content"]["application/json"]["schema"].clone()
    };
    assert_eq!(whole("query_depth")["oneOf"][1]["required"], json!(["region"]));
    assert_eq!(whole("check_reach")["allOf"][0]["anyOf"].as_array().map(Vec::len), Some(4));
    assert_eq!(field("query_depth", "/pixels/maxItems"), 4096);
    assert_eq!(field("send_joint_chunk", "/robots/anyOf").as_array().map(Vec::len), Some(50));
    assert_eq!(field("observe", "/robots/uniqueItems"), true);
    let both = field("walk", "/robots/items/not/allOf");
    assert_eq!(
        [&both[0]["required"], &both[1]["required"]],
        [&json!(["waist_yaw_rad"]), &json!(["look_at_m"])]
    );
    let note = &document["paths"]["/v1/episodes/{episode_id}/notes"]["post"]["requestBody"];
    let says = &note["content"]["application/json"]["schema"]["anyOf"];
    assert_eq!(says[0]["properties"]["text"]["minLength"], 1);
    assert_eq!(says[1]["required"], json!(["tokens"]));
}

/// With `until`, a command of a plan may have more steps than outside a plan.
#[test]
fn openapi_says_how_many_steps_a_planned_command_may_have() {
    let document = tandem_tools_spec::openapi("1.2.3", Hints::On, false);
    let post = &document["paths"]["/v1/episodes/{episode_id}/tools/send_plan"]["post"];
    let body = &post["requestBody"]["content"]["application/json"]["schema"];
    let planned = &body["properties"]["commands"]["items"]["anyOf"];
    let wait =
        planned.as_array().into_iter().flatten().find(|of| of["properties"]["tool"]["const"] == "wait");
    let wait = wait.expect("a plan may wait");
    let arguments = &wait["properties"]["arguments"];
    assert_eq!(arguments["required"], json!(["steps"]));
    assert_eq!(arguments["properties"]["steps"]["maximum"], 1500);
    let [short, until] = wait["anyOf"].as_array().map(Vec::as_slice).expect("two choices") else {
        panic!("{wait}")
    };
    assert_eq!(short["properties"]["arguments"]["properties"]["steps"]["maximum"], 50);
    assert_eq!(until["properties"]["until"]["const"], true);
}

#[test]
fn openapi_describes_every_tool() {
    let document = tandem_tools_spec::openapi("1.2.3", Hints::On, false).to_string();
    for spec in tool_specs(Hints::On) {
        assert!(
            document.contains(&format!("\"operationId\":\"{}\"", spec.name)),
            "{} has no path",
            spec.name
        );
    }
}

#[test]
fn joint_values_keep_their_order_and_four_decimals() {
    let values =
        tandem_tools_spec::JointValues(vec![("waist".into(), 0.639_963_209_6), ("elbow".into(), -1e-9)]);
    assert_eq!(serde_json::to_string(&values).unwrap(), r#"{"waist":0.64,"elbow":0.0}"#);
    let read: tandem_tools_spec::JointValues = serde_json::from_value(json!(values)).unwrap();
    assert_eq!((read.get("waist"), read.get("knee")), (Some(0.64), None));
}

/// An episode with two robots has no third robot.
#[test]
fn bodies_of_an_episode_name_its_own_robots() {
    let robots = ["A".to_owned(), "B".to_owned()];
    let patterns = |tool: &str| {
        let specs = episode_tool_specs(Hints::On, "x", &robots, 25, true);
        let spec = specs.iter().find(|spec| spec.name == tool).unwrap();
        let text = spec.body_schema.to_string();
        let found: Vec<String> = text
            .split("\"pattern\":\"")
            .skip(1)
            .filter_map(|rest| Some(rest.split('"').next()?.into()))
            .collect();
        found
    };
    for tool in ["observe", "get_robot_state", "query_depth", "check_reach", "walk", "send_joint_chunk"] {
        assert!(patterns(tool).iter().all(|pattern| pattern == "^[AB]$"), "{tool}: {:?}", patterns(tool));
        assert!(!patterns(tool).is_empty(), "{tool}");
    }
}

/// Fields about operators require operators, as the body's schema states.
#[test]
fn a_start_says_what_only_operators_can_have() {
    let document = tandem_tools_spec::openapi("1.2.3", Hints::On, false);
    let body =
        &document["paths"]["/v1/episodes"]["post"]["requestBody"]["content"]["application/json"]["schema"];
    assert_eq!(body["anyOf"][0]["properties"]["operators"]["const"], "per_robot");
    assert_eq!(body["anyOf"][1]["properties"]["patience_s"]["type"], "null");
    let document = |talk| tandem_tools_spec::openapi("1.2.3", Hints::On, talk).to_string();
    assert_eq!([document(false), document(true)].map(|text| text.contains("/tools/say")), [false, true]);
}
