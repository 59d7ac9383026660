//! Conversion of JSON Schema to Python's types, and to the expressions that parse them.

use serde_json::Value;

use super::described;

/// An argument of a tool, or a field of a class.
pub struct Parameter {
    /// Name on the wire.
    pub wire: String,
    /// Name in Python, where some names are keywords.
    pub name: String,
    pub kind: String,
    pub about: String,
    pub required: bool,
}

/// Returns the parameters for the arguments, with the required ones first.
pub fn parameters(schema: &Value) -> Vec<Parameter> {
    let properties = schema["properties"].as_object().into_iter().flatten();
    let parameter = |(wire, of): (&String, &Value)| {
        let (kind, may_be_null) = argument_type(of);
        // `None` is not sent, and a field that is not sent has its default.
        let may_be_null = may_be_null || !of["default"].is_null();
        Parameter {
            wire: wire.clone(),
            name: python_name(wire),
            kind: if may_be_null { format!("{kind} | None") } else { kind },
            about: described(of),
            required: !may_be_null,
        }
    };
    let mut parameters: Vec<Parameter> = properties.map(parameter).collect();
    parameters.sort_by_key(|parameter| !parameter.required);
    parameters
}

pub fn python_name(wire: &str) -> String {
    match wire {
        "from" | "in" | "is" | "class" | "def" | "not" | "or" | "and" | "if" | "else" | "for" | "with" => {
            format!("{wire}_")
        }
        _ => wire.into(),
    }
}

/// Returns the name that a reference refers to.
pub fn reference(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// Returns a schema without its null, and `true` if it had one.
pub fn without_null(schema: &Value) -> (Value, bool) {
    if let Some(choices) = schema["anyOf"].as_array() {
        let others: Vec<&Value> = choices.iter().filter(|choice| choice["type"] != "null").collect();
        if let ([one], true) = (others.as_slice(), choices.len() == 2) {
            return ((*one).clone(), true);
        }
    }
    if let Some([kind, null]) = schema["type"].as_array().map(Vec::as_slice)
        && null == "null"
    {
        let mut schema = schema.clone();
        schema["type"] = kind.clone();
        return (schema, true);
    }
    (schema.clone(), false)
}

/// Returns the type of a value that a caller passes.
fn argument_type(schema: &Value) -> (String, bool) {
    let (schema, may_be_null) = without_null(schema);
    let kind = match schema["type"].as_str() {
        _ if is_numbers(&schema) => "Numbers".into(),
        Some("array") => format!("Sequence[{}]", argument_type(&schema["items"]).0),
        _ => single(&schema),
    };
    (kind, may_be_null)
}

/// Returns true for an array of numbers, or of such arrays, which can be NumPy arrays.
fn is_numbers(schema: &Value) -> bool {
    let items = &schema["items"];
    schema["type"] == "array"
        && (items["type"] == "number" || items["type"] == "integer" || is_numbers(items))
}

/// Returns the type of a value in a reply.
pub fn reply_type(schema: &Value, plain: &dyn Fn(&str) -> Option<String>) -> String {
    let (schema, may_be_null) = without_null(schema);
    let kind = match schema["type"].as_str() {
        Some("array") => {
            let item = reply_type(&schema["items"], plain);
            match (schema["minItems"].as_u64(), schema["maxItems"].as_u64()) {
                (Some(least), Some(most)) if least == most => {
                    format!("tuple[{}]", vec![item; least as usize].join(", "))
                }
                _ => format!("tuple[{item}, ...]"),
            }
        }
        Some("object") => match schema["additionalProperties"].is_object() {
            true => format!("dict[str, {}]", reply_type(&schema["additionalProperties"], plain)),
            false => "dict[str, Any]".into(),
        },
        _ => match reference(&schema).and_then(plain) {
            Some(plain) => plain,
            None => single(&schema),
        },
    };
    if may_be_null { format!("{kind} | None") } else { kind }
}

fn single(schema: &Value) -> String {
    match (reference(schema), schema["type"].as_str()) {
        (Some(name), _) => name.into(),
        (None, Some("string")) => "str".into(),
        (None, Some("integer")) => "int".into(),
        (None, Some("number")) => "float".into(),
        (None, Some("boolean")) => "bool".into(),
        _ => "Any".into(),
    }
}
