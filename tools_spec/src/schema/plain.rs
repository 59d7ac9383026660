//! JSON Schema of types as they are: for replies and REST bodies, where nothing has to be strict.

use schemars::{JsonSchema, generate::SchemaSettings};
use serde_json::Value;

use crate::limits::bound_numbers;

/// The schema of `T` as it is, for replies: nothing has to be strict about what the server itself sends.
pub fn plain_schema<T: JsonSchema>() -> Value {
    let settings = SchemaSettings::draft2020_12().with(|s| s.inline_subschemas = true);
    settings.into_generator().into_root_schema_for::<T>().to_value()
}

/// The schema of `T` as a body that is read: what the checks refuse, it does not allow.
pub fn body_schema<T: JsonSchema>() -> Value {
    let mut schema = plain_schema::<T>();
    bound_numbers(&mut schema);
    schema
}
