//! The strict schema with one thing let go: a field that may be null may be left out. For hosts that check arguments against the
//! schema and do not insist on strictness, as those of MCP.

use serde_json::{Map, Value};

/// The schema in which only those fields are required that may not be null.
pub fn lenient_schema(strict: &Map<String, Value>) -> Map<String, Value> {
    let mut schema = Value::Object(strict.clone());
    let_go(&mut schema);
    schema.as_object_mut().map(std::mem::take).unwrap_or_default()
}

fn let_go(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(let_go),
        Value::Object(object) => {
            if let Some(Value::Object(properties)) = object.get("properties").cloned()
                && let Some(Value::Array(required)) = object.get_mut("required")
            {
                required.retain(|name| {
                    !properties.get(name.as_str().unwrap_or_default()).is_some_and(may_be_null)
                });
            }
            object.values_mut().for_each(let_go);
        }
        _ => {}
    }
}

fn may_be_null(schema: &Value) -> bool {
    let is_null = |kind: &Value| kind == "null";
    let listed = |keyword: &str| schema[keyword].as_array().is_some_and(|kinds| kinds.iter().any(is_null));
    let choices = schema["anyOf"].as_array();
    listed("type") || choices.is_some_and(|choices| choices.iter().any(|choice| is_null(&choice["type"])))
}
