//! JSON Schema of types as they are: for replies and REST bodies, where nothing has to be strict.

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::Value;

use crate::limits::bound_numbers;
use crate::parts::Hints;

/// The schema of `T` as it is, for replies: nothing has to be strict about what the server itself sends.
pub fn plain_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().to_value()
}

/// The schema of `T` as arguments, with its hints at the end of what they belong to, or without them.
pub fn argument_schema<T: JsonSchema>(hints: Hints) -> Value {
    let mut schema = plain_schema::<T>();
    tell(&mut schema, hints);
    schema
}

/// The schema of `T` as a body that is read: what the checks refuse, it does not allow. How many control steps a command may
/// have is still to be said.
pub fn body_schema<T: JsonSchema>(hints: Hints) -> Value {
    let mut schema = argument_schema::<T>(hints);
    bound_numbers(&mut schema);
    schema
}

fn tell(schema: &mut Value, hints: Hints) {
    match schema {
        Value::Array(items) => items.iter_mut().for_each(|item| tell(item, hints)),
        Value::Object(object) => {
            if object.get("hint").is_some_and(Value::is_string)
                && let Some(Value::String(hint)) = object.remove("hint")
                && hints == Hints::On
                && let Some(Value::String(text)) = object.get_mut("description")
            {
                *text = format!("{text} {hint}");
            }
            object.values_mut().for_each(|value| tell(value, hints));
        }
        _ => {}
    }
}
