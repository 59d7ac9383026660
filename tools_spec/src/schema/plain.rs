//! JSON Schema of types as they are: for replies and REST bodies, where nothing has to be strict.

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value};

use crate::limits::bound_numbers;
use crate::parts::{Assistance, Operators, Wording};

/// Returns the schema of `T` as it is, for replies: nothing has to be strict about what the server itself
/// sends.
pub fn plain_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().to_value()
}

/// Returns the schema of `T` as arguments. Where a policy is told less, the text that a description has for
/// that takes its place.
pub fn argument_schema<T: JsonSchema>(wording: Wording) -> Value {
    let mut schema = plain_schema::<T>();
    word(&mut schema, wording);
    schema
}

/// Returns the schema of `T` as a body that is read: what the checks refuse, it does not allow. How many
/// control steps a command may have is still to be said.
pub fn body_schema<T: JsonSchema>(wording: Wording) -> Value {
    let mut schema = argument_schema::<T>(wording);
    bound_numbers(&mut schema);
    schema
}

pub fn word(schema: &mut Value, wording: Wording) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| word(item, wording)),
        Value::Object(object) => {
            leave_to_full(object, wording);
            let mut text_of = |name: &str| match object.get(name)?.is_string() {
                true => object.remove(name)?.as_str().map(str::to_owned),
                false => None,
            };
            let of_paper = text_of("paper").filter(|_| wording.assistance == Assistance::Paper);
            let of_operator = text_of("operator").filter(|_| wording.operators == Operators::PerRobot);
            if let Some(own) = of_operator.or(of_paper) {
                object.insert("description".into(), own.into());
            }
            object.values_mut().for_each(|value| word(value, wording));
        }
        _ => {}
    }
}

/// Removes the fields that are for full assistance.
fn leave_to_full(object: &mut Map<String, Value>, wording: Wording) {
    let Some(Value::Object(properties)) = object.get_mut("properties") else { return };
    let mut left = Vec::new();
    for (name, property) in properties.iter_mut() {
        let marked = property.as_object_mut().and_then(|property| property.shift_remove("full_only"));
        if marked.is_some() && wording.assistance == Assistance::Paper {
            left.push(name.clone());
        }
    }
    properties.retain(|name, _| !left.contains(name));
    if let Some(Value::Array(required)) = object.get_mut("required") {
        required.retain(|name| name.as_str().is_none_or(|name| !left.iter().any(|left| left == name)));
    }
}
