//! Golden files of the contract as its callers see it. A change of the contract shows as a change of a file.
//!
//! `UPDATE_EXPECT=1 cargo test --workspace --release --test contract goldens` rewrites them.

use std::{env, fs, path::Path};

use serde_json::{Value, json};
use tandem_tools_spec::{Assistance, Format, Hints, ToolSpec, openapi, tool_specs};

/// Compares `face` with the file `name`, or rewrites the file.
fn check(name: &str, face: &Value) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/goldens").join(format!("{name}.json"));
    let text = serde_json::to_string_pretty(face).expect("JSON") + "\n";
    if env::var_os("UPDATE_EXPECT").is_some() {
        fs::write(&path, &text).expect("the file can be written");
    }
    let kept = fs::read_to_string(&path).unwrap_or_default();
    let differs = kept.lines().zip(text.lines()).find(|(kept, now)| kept != now);
    assert!(
        kept == text,
        "the contract has changed at {differs:?}; if that is meant, write {} anew with UPDATE_EXPECT=1",
        path.display()
    );
}

#[test]
fn tools_in_every_format() {
    let specs = tool_specs(Hints::On);
    for format in Format::ALL {
        let tools: Vec<Value> = specs.iter().map(|spec| spec.formatted(format)).collect();
        check(format.name(), &json!(tools));
    }
}

/// Returns the tools of `other` that are not equal to any tool of `one`.
fn differing(one: Vec<ToolSpec>, other: Vec<ToolSpec>) -> Value {
    other.into_iter().filter(|other| !one.contains(other)).map(|other| json!(other)).collect()
}

/// Some tools have different texts under `paper`.
#[test]
fn tools_of_paper() {
    check("paper", &differing(tool_specs(Hints::Off), tool_specs(Assistance::Paper)));
}

/// Fifty alternatives state that robots have equally many rows; the golden file keeps three of them.
#[test]
fn openapi_document() {
    let mut document = openapi("0.0.0", Hints::On, false);
    let chunk = "/paths/~1v1~1episodes~1{episode_id}~1tools~1send_joint_chunk/post/requestBody/content/application~1json/schema";
    let rows = document.pointer_mut(&format!("{chunk}/properties/robots/anyOf"));
    let rows = rows.and_then(Value::as_array_mut).expect("the alternatives");
    assert_eq!(rows.len(), 50);
    rows.truncate(3);
    check("openapi", &document);
}
