//! JSON Schema of types without strictness: for replies and REST bodies.

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::{Map, Value};

use crate::limits::bound_numbers;
use crate::parts::{Assistance, Operators, Wording};

/// Marks of fields for policies with full assistance, and of fields for operators.
const FULL_ONLY: &str = "full_only";
const FOR_OPERATORS: &str = "for_operators";

/// Returns the schema of `T` for replies. It is not strict, because the server itself sends replies.
pub fn plain_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().to_value()
}

/// Returns the schema of `T` as arguments in a list of tools. Its texts depend on the policy's assistance. If
/// one policy directs all robots, the fields for operators are left out.
pub fn listed_schema<T: JsonSchema>(wording: Wording) -> Value {
    let mut schema = plain_schema::<T>();
    if wording.operators == Operators::One {
        leave_to_operators(&mut schema);
    }
    word(&mut schema, wording);
    schema
}

/// Returns the schema of `T` as a request body. It excludes values that the checks refuse. The maximum number
/// of control steps is added later.
pub fn body_schema<T: JsonSchema>(wording: Wording) -> Value {
    let mut schema = plain_schema::<T>();
    word(&mut schema, wording);
    bound_numbers(&mut schema);
    schema
}

pub fn word(schema: &mut Value, wording: Wording) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| word(item, wording)),
        Value::Object(object) => {
            drop_marked(object, FULL_ONLY, wording.assistance == Assistance::Paper);
            drop_marked(object, FOR_OPERATORS, false);
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

fn leave_to_operators(schema: &mut Value) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(leave_to_operators),
        Value::Object(object) => {
            drop_marked(object, FOR_OPERATORS, true);
            object.values_mut().for_each(leave_to_operators);
        }
        _ => {}
    }
}

/// Removes a mark from all fields that have it. If `with_fields`, removes these fields instead.
fn drop_marked(object: &mut Map<String, Value>, mark: &str, with_fields: bool) {
    let Some(Value::Object(properties)) = object.get_mut("properties") else { return };
    let mut left = Vec::new();
    for (name, property) in properties.iter_mut() {
        let marked = property.as_object_mut().and_then(|property| property.shift_remove(mark));
        if marked.is_some() && with_fields {
            left.push(name.clone());
        }
    }
    properties.retain(|name, _| !left.contains(name));
    if let Some(Value::Array(required)) = object.get_mut("required") {
        required.retain(|name| name.as_str().is_none_or(|name| !left.iter().any(|left| left == name)));
    }
}
