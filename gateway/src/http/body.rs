//! Parsing of request bodies: one object in JSON or MessagePack, in which no object has duplicate fields.

use std::fmt;

use serde::{
    Deserialize, Deserializer,
    de::{DeserializeSeed, Error as _, MapAccess, SeqAccess, Visitor},
};
use serde_json::{Map, Number, Value};

use super::problem::ApiError;

/// Parses the JSON object in `body`. An empty body is an object without fields.
pub fn json_object(body: &[u8]) -> Result<Value, ApiError> {
    if body.is_empty() {
        return Ok(Value::Object(Map::new()));
    }
    let UniqueFields(value) =
        serde_json::from_slice(body).map_err(|error| ApiError::MalformedJson(error.to_string()))?;
    object(value)
}

/// Maximum nesting of arrays and maps, the same as in serde_json.
const MAX_DEPTH: usize = 128;

/// Parses the MessagePack map in `body`. An empty body is a map without fields.
pub fn msgpack_object(body: &[u8]) -> Result<Value, ApiError> {
    if body.is_empty() {
        return Ok(Value::Object(Map::new()));
    }
    let mut left = body;
    let mut reader = rmp_serde::Deserializer::new(&mut left);
    reader.set_max_depth(MAX_DEPTH);
    let malformed = |error: String| ApiError::MalformedMsgpack(error);
    let UniqueFields(value) =
        Deserialize::deserialize(&mut reader).map_err(|error| malformed(error.to_string()))?;
    match left.len() {
        0 => object(value),
        more => Err(malformed(format!("{more} bytes follow it"))),
    }
}

fn object(value: Value) -> Result<Value, ApiError> {
    match value {
        Value::Object(_) => Ok(value),
        Value::Null => Err(ApiError::NoObject("null")),
        Value::Bool(_) => Err(ApiError::NoObject("a truth value")),
        Value::Number(_) => Err(ApiError::NoObject("a number")),
        Value::String(_) => Err(ApiError::NoObject("a text")),
        Value::Array(_) => Err(ApiError::NoObject("an array")),
    }
}

/// Refuses invalid JSON and JSON with duplicate fields in an object.
pub fn check_unique_fields(body: &[u8]) -> Result<(), String> {
    let read: Result<UniqueFields, _> = serde_json::from_slice(body);
    read.map(drop).map_err(|error| error.to_string())
}

/// JSON without duplicate fields. Parsers differ in which of two duplicate values they keep.
struct UniqueFields(Value);

impl<'de> Deserialize<'de> for UniqueFields {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        UniqueFieldsVisitor.deserialize(deserializer).map(UniqueFields)
    }
}

struct UniqueFieldsVisitor;

impl<'de> DeserializeSeed<'de> for UniqueFieldsVisitor {
    type Value = Value;

    fn deserialize<D: Deserializer<'de>>(self, deserializer: D) -> Result<Value, D::Error> {
        deserializer.deserialize_any(self)
    }
}

impl<'de> Visitor<'de> for UniqueFieldsVisitor {
    type Value = Value;

    fn expecting(&self, text: &mut fmt::Formatter) -> fmt::Result {
        text.write_str("JSON")
    }

    fn visit_unit<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    // MessagePack calls this nil.
    fn visit_none<E>(self) -> Result<Value, E> {
        Ok(Value::Null)
    }

    fn visit_bool<E>(self, value: bool) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_i64<E>(self, value: i64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_u64<E>(self, value: u64) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_f64<E: serde::de::Error>(self, value: f64) -> Result<Value, E> {
        Number::from_f64(value).map(Value::Number).ok_or_else(|| E::custom("a number is too large"))
    }

    fn visit_str<E>(self, value: &str) -> Result<Value, E> {
        Ok(value.into())
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut items: A) -> Result<Value, A::Error> {
        let mut array = Vec::new();
        while let Some(item) = items.next_element_seed(UniqueFieldsVisitor)? {
            array.push(item);
        }
        Ok(array.into())
    }

    fn visit_map<A: MapAccess<'de>>(self, mut fields: A) -> Result<Value, A::Error> {
        let mut object = Map::new();
        while let Some(name) = fields.next_key::<String>()? {
            let value = fields.next_value_seed(UniqueFieldsVisitor)?;
            if object.contains_key(&name) {
                return Err(A::Error::custom(format_args!("the field {name:?} stands there twice")));
            }
            object.insert(name, value);
        }
        Ok(object.into())
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn objects_come_as_they_were_sent() {
        let sent = json!({ "a": [1, -2, 2.5, null, true, "text", {}], "b": { "a": 1e300 }, "c": u64::MAX });
        assert_eq!(json_object(sent.to_string().as_bytes()).unwrap(), sent);
        assert_eq!(json_object(b"").unwrap(), json!({}));
    }

    #[test]
    fn msgpack_is_read_as_json_is() {
        let sent = json!({ "a": [1, -2, 2.5, null, true, "text", {}], "b": { "a": 1e300 }, "c": u64::MAX });
        assert_eq!(msgpack_object(&rmp_serde::to_vec(&sent).unwrap()).unwrap(), sent);
        assert_eq!(msgpack_object(b"").unwrap(), json!({}));
        let check = |body: &[u8], says: &str| {
            let text = msgpack_object(body).unwrap_err().to_string();
            assert!(text.contains(says), "{body:?}: {text}");
        };
        check(b"\xc0", "the body is null");
        check(b"\x91\x05", "the body is an array");
        check(b"\x82\xa1a\x01\xa1a\x02", "\"a\" stands there twice");
        check(b"\x81\xa1a", "no MessagePack");
        check(b"\x81\xa1a\x01\x80", "1 bytes follow it");
        check(b"\x81\xa1a\xcb\x7f\xf0\0\0\0\0\0\0", "too large");
        check(b"\x81\xa1a\xc4\x01\0", "no MessagePack");
        check(&[0x91; 100_000], "no MessagePack");
        check(b"\xdf\xff\xff\xff\xff", "no MessagePack");
    }

    #[test]
    fn what_is_no_object_or_two_is_refused() {
        let check = |body: &str, says: &str| {
            let text = json_object(body.as_bytes()).unwrap_err().to_string();
            assert!(text.contains(says), "{body}: {text}");
        };
        check("null", "the body is null");
        check("[{\"steps\": 5}]", "the body is an array");
        check("5", "the body is a number");
        check("{\"steps\": 5, \"steps\": 6}", "\"steps\" stands there twice");
        check("{\"robots\": [{\"robot\": \"A\", \"robot\": \"B\"}]}", "\"robot\" stands there twice");
        check("{\"steps\": 5} {}", "no JSON");
        check("{\"steps\": 1e999}", "no JSON");
        check(&"[".repeat(100_000), "no JSON");
    }
}
