//! What [`crate::checks`] refuses, as JSON Schema says it, so that a caller who keeps to the schema is not refused for it.

use serde_json::{Value, json};

/// No number of this contract, in metres, radians or metres per second, is anywhere near this large; a larger one would
/// overflow the single precision of the physics.
pub const LARGEST: f64 = 1e6;

/// A quaternion whose largest component is smaller has no direction.
pub const SMALLEST_COMPONENT: f64 = 1e-6;

/// The most control steps that any protocol allows for one command.
pub const MOST_STEPS: usize = 50;

/// Names of robots, of which an episode has the first two or three.
pub const ROBOT_NAMES: [&str; 3] = ["A", "B", "C"];

/// The names as a pattern.
pub const ROBOT_PATTERN: &str = "^[ABC]$";

/// What head cameras see, in pixels: columns and rows.
const PICTURE_PX: [u32; 2] = [320, 240];

/// `contains` of a quaternion: it has a direction.
pub fn direction() -> Value {
    json!({ "anyOf": [{ "minimum": SMALLEST_COMPONENT }, { "maximum": -SMALLEST_COMPONENT }] })
}

/// `allOf` of a list with an entry per robot: none is named twice.
pub fn each_robot_once() -> Value {
    let once = |name: &&str| {
        let named = json!({ "properties": { "robot": { "const": name } }, "required": ["robot"] });
        json!({ "contains": named, "minContains": 0, "maxContains": 1 })
    };
    ROBOT_NAMES.iter().map(once).collect()
}

/// `items` of a list of pixels.
pub fn pixel() -> Value {
    let inside = PICTURE_PX.map(|px| json!({ "type": "integer", "minimum": 0, "maximum": px - 1 }));
    json!({
        "type": "array", "prefixItems": inside, "items": { "type": "integer" }, "minItems": 2, "maxItems": 2,
    })
}

/// Bounds every number of a schema that has none: integers are left alone, whose types bound them.
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
                object.insert("minimum".into(), json!(-LARGEST));
                object.insert("maximum".into(), json!(LARGEST));
            }
            object.values_mut().for_each(bound_numbers);
        }
        _ => {}
    }
}
