//! The faces that one contract has: with and without hints, strict and lenient, of any episode and of one that runs.

use serde_json::{Value, json};
use tandem_tools_spec::{Hints, ToolSpec, episode_tool_specs, openapi, tool_specs};

/// Everything that a policy is told of the tools, face by face.
fn faces(hints: Hints) -> Vec<String> {
    let specs = tool_specs(hints);
    let lenient: Vec<_> = specs.iter().map(ToolSpec::lenient_schema).collect();
    let faces =
        [json!(specs), json!(lenient), json!(episode_tool_specs(hints, "x", 25)), openapi("1.2.3", hints)];
    // Texts of OpenAPI break their lines where the source does.
    faces.map(|face| face.to_string().replace("\\n", " ")).to_vec()
}

#[test]
fn recipes_are_told_on_every_face_or_on_none() {
    const RECIPES: [&str; 3] = ["To grasp an upright bottle", "Closed around a bottle", "open: [0, 0.3,"];
    const GEOMETRY: [&str; 3] =
        ["A hand closes on what lies 0.12 m along x", "Negative angles", "palms face each other"];
    for (face, (with, without)) in faces(Hints::On).iter().zip(faces(Hints::Off)).enumerate() {
        for recipe in RECIPES {
            assert!(with.contains(recipe), "face {face} lacks {recipe:?}");
            assert!(!without.contains(recipe), "face {face} tells {recipe:?}");
        }
        for fact in GEOMETRY {
            assert!(with.contains(fact) && without.contains(fact), "face {face} lacks {fact:?}");
        }
        assert!(!with.contains("\"hint\"") && !without.contains("\"hint\""), "face {face}");
        assert!(!with.contains("most_steps"), "face {face}");
    }
}

fn spec(name: &str) -> ToolSpec {
    tool_specs(Hints::On).into_iter().find(|spec| spec.name == name).expect("a tool")
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
    assert_eq!(json!(spec("observe").input_schema)["required"], json!(["episode_id", "robots", "short"]));
    let body = |name: &str| spec(name).body_schema(50)["required"].clone();
    assert_eq!((body("query_depth"), body("observe")), (json!(["robot"]), Value::Null));
}

#[test]
fn every_tool_names_its_route_and_openapi_has_it() {
    let document = openapi("1.2.3", Hints::On);
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
    let specs = episode_tool_specs(Hints::On, "handover-seed0", 25);
    let body = |name: &str| {
        let found = specs.iter().find(|tool| tool.spec.name == name).expect("a tool");
        assert_eq!(found.spec.route.path, format!("/v1/episodes/handover-seed0/tools/{name}"));
        &found.body_schema["properties"]
    };
    for name in ["wait", "walk", "move_wrists"] {
        assert_eq!(body(name)["steps"]["maximum"], 25, "{name}");
    }
    let robots = &body("send_joint_chunk")["robots"];
    assert_eq!(robots["items"]["properties"]["rows"]["maxItems"], 25);
    let lengths: Vec<&Value> = robots["anyOf"].as_array().into_iter().flatten().collect();
    assert_eq!(lengths.len(), 25);
    let rows = json!({ "minItems": 3, "maxItems": 3 });
    assert_eq!(lengths[2], &json!({ "items": { "properties": { "rows": rows } } }));
    assert!(specs.iter().all(|tool| tool.spec.on_episode));
}
