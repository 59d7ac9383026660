//! JSON Schema that strict hosts accept: every field required, nullable instead of optional, no unknown
//! fields, and none of the keywords (`minimum`, `maxItems`, `format`, ...) that they refuse or warn about.
//! The server checks those itself.

use schemars::JsonSchema;
use serde_json::{Map, Value, json};

use super::nullable::as_choices;
use super::plain::listed_schema;
use crate::parts::Wording;

/// Keywords that OpenAI's strict mode or common MCP clients refuse or warn about.
const DROPPED: &[&str] = &[
    "$schema",
    "title",
    "format",
    "minimum",
    "maximum",
    "exclusiveMinimum",
    "exclusiveMaximum",
    "minItems",
    "maxItems",
    "minLength",
    "maxLength",
    "pattern",
    "prefixItems",
    "uniqueItems",
    "contains",
    "not",
    "allOf",
    // Our mark in schemas of bodies.
    "most_steps",
];

/// Returns the description of `T`, and its schema without the description. The schema has defaults if
/// `defaults` is true; strict hosts refuse them.
pub fn strict_schema<T: JsonSchema>(wording: Wording, defaults: bool) -> (String, Map<String, Value>) {
    let mut schema = listed_schema::<T>(wording);
    if !defaults {
        drop_defaults(&mut schema);
    }
    make_strict(&mut schema);
    let mut object = schema.as_object_mut().map(std::mem::take).unwrap_or_default();
    let description = match object.remove("description") {
        Some(Value::String(text)) => text,
        _ => String::new(),
    };
    (description, object)
}

/// Name and text of the field that requests a short reply from any tool.
pub const SHORT: &str = "short";
pub const SHORTLY: &str = "True: a shorter reply, without what is as expected.";

/// Adds the field that requests a short reply. Strict hosts limit the number of nullable fields, so it is not
/// nullable.
pub fn require_short(schema: &mut Map<String, Value>, default: bool) {
    let mut short = json!({ "type": "boolean", "description": SHORTLY });
    if default {
        short["default"] = false.into();
    }
    if let Some(Value::Object(properties)) = schema.get_mut("properties") {
        properties.insert(SHORT.into(), short);
    }
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        required.push(json!(SHORT));
    }
}

/// Adds the episode's handle. It is in the path over REST, and among the arguments otherwise.
pub fn require_episode_id(schema: &mut Map<String, Value>) {
    let handle = json!({ "type": "string", "description": "The episode." });
    if let Some(Value::Object(properties)) = schema.get_mut("properties") {
        properties.shift_insert(0, "episode_id".into(), handle);
    }
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        required.insert(0, json!("episode_id"));
    }
}

fn drop_defaults(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(drop_defaults),
        Value::Object(object) => {
            object.remove("default");
            object.values_mut().for_each(drop_defaults);
        }
        _ => {}
    }
}

fn make_strict(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(make_strict),
        Value::Object(object) => {
            DROPPED.iter().for_each(|keyword| drop(object.remove(*keyword)));
            unwrap_lines(object);
            list_choices(object);
            as_choices(object);
            if object.get("type").is_some_and(|kind| kind == "object") {
                close_object(object);
            }
            // A property may have the name of a keyword, so only the schemas of properties are made strict,
            // not their names.
            for (keyword, value) in object.iter_mut() {
                match value {
                    Value::Object(properties) if keyword == "properties" => {
                        properties.values_mut().for_each(make_strict);
                    }
                    _ => make_strict(value),
                }
            }
        }
        _ => {}
    }
}

/// Joins the lines of descriptions, which are broken like the source.
pub fn unwrap_lines(object: &mut Map<String, Value>) {
    if let Some(Value::String(text)) = object.get_mut("description") {
        *text = text.replace("\n\n", "\u{1}").replace('\n', " ").replace('\u{1}', "\n\n");
    }
}

/// Replaces `oneOf`, which strict hosts refuse and schemars writes for an enum with described variants. The
/// names become an `enum`, and their descriptions part of the enum's description. Of any other `oneOf`, only
/// the texts are kept.
pub fn list_choices(object: &mut Map<String, Value>) {
    let Some(Value::Array(choices)) = object.remove("oneOf") else {
        return;
    };
    if choices.iter().any(|choice| choice.get("const").is_none()) {
        return;
    }
    let mut description = object["description"].as_str().unwrap_or_default().to_owned();
    for choice in &choices {
        if let (Some(name), Some(text)) = (choice["const"].as_str(), choice["description"].as_str()) {
            description += &format!(" \"{name}\": {}", text.replace('\n', " "));
        }
    }
    let names: Vec<Value> = choices.iter().map(|choice| choice["const"].clone()).collect();
    object.insert("type".into(), json!("string"));
    object.insert("enum".into(), names.into());
    object.insert("description".into(), description.into());
}

fn close_object(object: &mut Map<String, Value>) {
    // A field that accepts any object remains unchanged.
    if object.get("additionalProperties") == Some(&Value::Bool(true)) {
        return;
    }
    let properties = object.entry("properties").or_insert_with(|| json!({}));
    let names: Vec<Value> =
        properties.as_object().into_iter().flatten().map(|(name, _)| json!(name)).collect();
    object.insert("required".into(), names.into());
    object.insert("additionalProperties".into(), Value::Bool(false));
}
