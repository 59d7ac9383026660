//! Limits of [`crate::checks`] as JSON Schema, so that calls that conform to the schema pass these checks.

use serde_json::{Value, json};

/// Maximum absolute value of a number in the contract. Sensible values in metres, radians or metres per
/// second are far smaller; larger values would overflow the single precision of the physics.
pub const LARGEST: f64 = 1e6;

/// Minimum of the largest absolute component of a quaternion. Below it, the quaternion has no direction.
pub const SMALLEST_COMPONENT: f64 = 1e-6;

/// Maximum number of control steps of one command under any protocol.
pub const MAX_STEPS: u32 = 50;

/// Maximum number of pixels in one call.
pub const MAX_PIXELS: usize = 4096;

/// Names of robots. An episode has the first two or three.
pub const ROBOT_NAMES: [&str; 3] = ["A", "B", "C"];

/// Regular expression for the names of robots.
pub const ROBOT_PATTERN: &str = "^[ABC]$";

/// Image size of head cameras in pixels: columns and rows.
const PICTURE_PX: [u32; 2] = [320, 240];

/// Returns `contains` for a quaternion, which requires a direction.
pub fn direction() -> Value {
    json!({ "anyOf": [{ "minimum": SMALLEST_COMPONENT }, { "maximum": -SMALLEST_COMPONENT }] })
}

/// Returns `not` for a list with an entry per robot: a robot is named twice. (`maxContains` would be shorter,
/// but readers of older drafts interpret the `contains` beside it as a requirement.)
pub fn a_robot_twice() -> Value {
    let twice = |name: &str, first: usize, second: usize| {
        let mut entries = vec![json!({}); second + 1];
        let named = json!({ "properties": { "robot": { "const": name } } });
        entries[first] = named.clone();
        entries[second] = named;
        json!({ "prefixItems": entries, "minItems": second + 1 })
    };
    let places = (1..ROBOT_NAMES.len()).flat_map(|second| (0..second).map(move |first| (first, second)));
    let all = places.flat_map(|(first, second)| ROBOT_NAMES.map(|name| twice(name, first, second)));
    json!({ "anyOf": all.collect::<Vec<_>>() })
}

/// Returns `items` for a list of pixels.
pub fn pixel() -> Value {
    json!({
        "type": "array", "prefixItems": pixel_range(), "items": { "type": "integer" }, "minItems": 2, "maxItems": 2,
    })
}

/// Returns `prefixItems` for a pixel.
pub fn pixel_range() -> Value {
    json!(PICTURE_PX.map(|px| json!({ "type": "integer", "minimum": 0, "maximum": px - 1 })))
}

/// Returns `oneOf` for an object that has exactly one of these fields. Each field is given with its type when
/// it is not null.
pub fn one_of(fields: &[(&str, &str)]) -> Value {
    fields.iter().map(|(field, kind)| has(field, kind)).collect()
}

/// Returns `allOf` for an object with at least one of these fields, each of which is a list.
pub fn at_least_one(fields: &[&str]) -> Value {
    let given: Vec<Value> = fields.iter().map(|field| has(field, "array")).collect();
    json!([{ "anyOf": given }])
}

/// Returns `not` for an object that must not have all of these fields. Each field is given with its type when
/// it is not null.
pub fn all_of(fields: &[(&str, &str)]) -> Value {
    let given: Vec<Value> = fields.iter().map(|(field, kind)| has(field, kind)).collect();
    json!({ "allOf": given })
}

fn has(field: &str, kind: &str) -> Value {
    json!({ "required": [field], "properties": { field: { "type": kind } } })
}

/// Limits the number of control steps of commands at each mark `most_steps`: as `maximum`, `maxItems` or
/// `equal_rows`. `equal_rows` is for a list with an entry per robot, all with the same number of rows.
pub fn bound_steps(schema: &mut Value, most_steps: u32) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| bound_steps(item, most_steps)),
        Value::Object(object) => {
            if let Some(Value::String(marked)) = object.get("most_steps").cloned() {
                object.remove("most_steps");
                let (keyword, bound) = match marked.as_str() {
                    "equal_rows" => ("anyOf", equal_rows(most_steps)),
                    _ => (marked.as_str(), json!(most_steps)),
                };
                object.insert(keyword.into(), bound);
            }
            object.values_mut().for_each(|value| bound_steps(value, most_steps));
        }
        _ => {}
    }
}

fn equal_rows(most_steps: u32) -> Value {
    let rows = |count: u32| json!({ "minItems": count, "maxItems": count });
    let each = |count: u32| json!({ "items": { "properties": { "rows": rows(count) } } });
    (1..=most_steps).map(each).collect::<Vec<_>>().into()
}

/// Restricts names of robots to `robots`, and lists with an entry per robot to the number of robots.
pub fn bound_robots(schema: &mut Value, robots: &[String]) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| bound_robots(item, robots)),
        Value::Object(object) => {
            if let Some(pattern) = object.get_mut("pattern").filter(|pattern| **pattern == ROBOT_PATTERN) {
                *pattern = format!("^[{}]$", robots.concat()).into();
            }
            if let Some(list) = object.get_mut("robots").and_then(|list| list.get_mut("maxItems")) {
                *list = robots.len().into();
            }
            object.values_mut().for_each(|value| bound_robots(value, robots));
        }
        _ => {}
    }
}

/// Bounds every number in a schema that has no bound yet. Integers remain unchanged, because their types
/// bound them.
pub fn bound_numbers(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(bound_numbers),
        Value::Object(object) => {
            let is_number = match object.get("type") {
                Some(Value::String(kind)) => kind == "number",
                Some(Value::Array(kinds)) => kinds.iter().any(|kind| kind == "number"),
                _ => false,
            };
            if is_number {
                object.entry("minimum").or_insert(json!(-LARGEST));
                object.entry("maximum").or_insert(json!(LARGEST));
            }
            object.values_mut().for_each(bound_numbers);
        }
        _ => {}
    }
}
