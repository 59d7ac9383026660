//! JSON Schema for a model that reads the list of an episode's tools. It contains types, lengths and bounds,
//! and omits texts that refusals contain.

use serde_json::{Map, Value};

use super::nullable::{as_choices, leave_out};
use super::strict::{list_choices, unwrap_lines};
use crate::limits::LARGEST;

/// Keywords that only validators need.
const FOR_VALIDATORS: &[&str] = &[
    "$schema",
    "title",
    "format",
    "additionalProperties",
    "not",
    "anyOf",
    "allOf",
    "contains",
    "prefixItems",
    "uniqueItems",
];

/// Rewrites the schema of a body. Nullable fields become optional, and parts that only validators need are
/// removed.
pub fn make_readable(schema: &mut Value) {
    for_each(schema, &mut |object| {
        list_choices(object);
        unwrap_lines(object);
        as_choices(object);
    });
    leave_out(schema, true);
    for_each(schema, &mut |object| {
        object.retain(|keyword, value| {
            !FOR_VALIDATORS.contains(&keyword.as_str()) && !is_no_bound(keyword, value)
        });
    });
}

/// Calls `change` with `schema` and every schema below it. Properties may have the names of keywords.
fn for_each(schema: &mut Value, change: &mut impl FnMut(&mut Map<String, Value>)) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| for_each(item, change)),
        Value::Object(object) => {
            change(object);
            for (keyword, value) in object.iter_mut() {
                match value {
                    Value::Object(properties) if keyword == "properties" => {
                        properties.values_mut().for_each(|property| for_each(property, change));
                    }
                    _ => for_each(value, change),
                }
            }
        }
        _ => {}
    }
}

/// Returns true for a bound that is merely the largest number of the contract or of the bounded type.
fn is_no_bound(keyword: &str, value: &Value) -> bool {
    let far = value.as_f64().is_some_and(|bound| bound.abs() >= LARGEST);
    far && ["minimum", "maximum"].contains(&keyword)
}

/// Shortens the field of a command that contains the arguments of another tool in the list.
pub fn refer_to_list(properties: &mut Map<String, Value>, tool: &str) {
    if let Some(Value::Object(arguments)) = properties.get_mut(tool) {
        arguments.remove("properties");
    }
}
