//! Optional fields, expressed by null or by omission.

use serde_json::{Map, Value, json};

/// Rewrites a field's two types as two alternatives. Strict hosts and common MCP clients read alternatives;
/// some do not read a list of types.
pub fn as_choices(object: &mut Map<String, Value>) {
    let Some(Value::Array(kinds)) = object.get("type") else { return };
    let kinds = kinds.clone();
    let description = object.remove("description");
    let mut rest = std::mem::take(object);
    let choices = kinds.into_iter().map(|kind| {
        if kind == "null" {
            return json!({ "type": kind });
        }
        rest.insert("type".into(), kind);
        Value::Object(rest.clone())
    });
    let choices: Vec<Value> = choices.collect();
    object.extend(description.map(|text| ("description".into(), text)));
    object.insert("anyOf".into(), choices.into());
}

/// Makes nullable fields optional: at every level if `own_fields`, otherwise only within lists, because the
/// call's own fields must remain nullable. Their texts change accordingly.
pub fn leave_out(schema: &mut Value, own_fields: bool) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| leave_out(item, own_fields)),
        Value::Object(object) => {
            if own_fields {
                leave_out_own(object);
            }
            for (keyword, value) in object.iter_mut() {
                leave_out(value, own_fields || keyword == "items");
            }
        }
        _ => {}
    }
}

fn leave_out_own(object: &mut Map<String, Value>) {
    let Some(Value::Object(properties)) = object.get_mut("properties") else { return };
    let mut optional = Vec::new();
    for (name, property) in properties {
        if let Some(choice) = the_choice_beside_null(property) {
            *property = choice;
            optional.push(name.clone());
        } else if property.get("default").is_some() {
            optional.push(name.clone());
        }
    }
    if let Some(Value::Array(required)) = object.get_mut("required") {
        required.retain(|name| name.as_str().is_none_or(|name| !optional.iter().any(|left| left == name)));
    }
}

/// Returns the schema of a nullable field as the schema of an optional field.
fn the_choice_beside_null(property: &Value) -> Option<Value> {
    let choices = property["anyOf"].as_array()?;
    let is_null = |choice: &&Value| choice["type"] == "null";
    choices.iter().find(is_null)?;
    let mut choice = choices.iter().find(|choice| !is_null(choice))?.clone();
    if let Some(Value::Array(values)) = choice.get_mut("enum") {
        values.retain(|value| !value.is_null());
    }
    let texts = [property, &choice].map(|described| described["description"].as_str());
    let text = texts.into_iter().flatten().collect::<Vec<_>>().join(" ");
    choice["description"] = text.replace("Null:", "Left out:").replace(" or null:", " or left out:").into();
    Some(choice)
}
