//! msgpack with numpy arrays, in the two dialects of policy servers.

use rmpv::{Value, decode, encode};

use crate::values::{Array, ReplyValue, RequestValue};

/// Encoding of an array: a map whose keys are bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Dialect {
    /// Keys `__ndarray__`, `data`, `dtype` and `shape`, as in openpi-client's module `msgpack_numpy`.
    Openpi,
    /// Keys `nd`, `type`, `kind`, `shape` and `data`, as in the package msgpack-numpy.
    MsgpackNumpy,
}

/// Encodes a request.
pub fn written(request: &RequestValue, dialect: Dialect) -> Vec<u8> {
    bytes_of(&request_value(request, dialect))
}

/// Encodes a value.
pub fn bytes_of(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Writing to memory cannot fail.
    let _ = encode::write_value(&mut bytes, value);
    bytes
}

/// Converts a request to a value that can be part of another value.
pub fn request_value(request: &RequestValue, dialect: Dialect) -> Value {
    let value = |request| request_value(request, dialect);
    match request {
        RequestValue::Map(entries) => {
            Value::Map(entries.iter().map(|(key, request)| (key.as_str().into(), value(request))).collect())
        }
        RequestValue::Array(array) => ndarray(array, dialect),
        RequestValue::Text(text) => text.as_str().into(),
        RequestValue::List(items) => Value::Array(items.iter().map(value).collect()),
    }
}

fn ndarray(array: &Array, dialect: Dialect) -> Value {
    let key = |name: &str| Value::Binary(name.into());
    let data = Value::Binary(array.bytes());
    let shape = Value::Array(array.shape.iter().map(|side| (*side as u64).into()).collect());
    Value::Map(match dialect {
        Dialect::Openpi => vec![
            (key("__ndarray__"), true.into()),
            (key("data"), data),
            (key("dtype"), array.dtype().into()),
            (key("shape"), shape),
        ],
        Dialect::MsgpackNumpy => vec![
            (key("nd"), true.into()),
            (key("type"), array.dtype().into()),
            (key("kind"), Value::Binary(Vec::new())),
            (key("shape"), shape),
            (key("data"), data),
        ],
    })
}

/// Decodes an answer. Lists of numbers also become arrays.
pub fn read_reply(bytes: &[u8]) -> Result<ReplyValue, String> {
    reply_value(read(bytes)?)
}

/// Decodes exactly one value.
pub fn read(mut bytes: &[u8]) -> Result<Value, String> {
    let value = decode::read_value(&mut bytes).map_err(|error| format!("no msgpack: {error}"))?;
    match bytes.is_empty() {
        true => Ok(value),
        false => Err(format!("{} bytes after the end of a msgpack value", bytes.len())),
    }
}

/// Converts a value that may contain arrays of either dialect.
pub fn reply_value(value: Value) -> Result<ReplyValue, String> {
    if let Some(number) = value.as_f64() {
        return Ok(ReplyValue::number(number));
    }
    match value {
        Value::Map(entries) => of_map(entries),
        Value::Array(items) => {
            items.into_iter().map(reply_value).collect::<Result<_, _>>().map(ReplyValue::list)
        }
        Value::String(text) => Ok(ReplyValue::Text(text.as_str().unwrap_or("no UTF-8").into())),
        other => Ok(ReplyValue::Other(format!("a {}", kind(&other)))),
    }
}

/// Returns the value under `key`, which may be encoded as text or as bytes.
pub fn entry<'a>(entries: &'a [(Value, Value)], key: &str) -> Option<&'a Value> {
    entries.iter().find(|(name, _)| name.as_slice() == Some(key.as_bytes())).map(|(_, value)| value)
}

fn of_map(entries: Vec<(Value, Value)>) -> Result<ReplyValue, String> {
    let find = |name: &str| entry(&entries, name);
    let array = |dtype: &str| {
        // A packed numpy scalar has no shape.
        let shape = find("shape").and_then(Value::as_array).into_iter().flatten();
        let shape: Option<Vec<usize>> = shape.map(|side| side.as_u64()?.try_into().ok()).collect();
        let dtype = find(dtype).and_then(text).unwrap_or_default();
        let data = find("data").and_then(Value::as_slice).ok_or("an array without data")?;
        ReplyValue::from_bytes(&dtype, shape.ok_or("an array with a side that is no number")?, data)
    };
    if find("__ndarray__").is_some() {
        return array("dtype");
    }
    if find("__npgeneric__").is_some() {
        return reply_value(find("data").cloned().unwrap_or(Value::Nil));
    }
    if find("nd").is_some_and(Value::is_bool) {
        return array("type");
    }
    let named = entries.into_iter().map(|(key, value)| {
        let key = text(&key).ok_or("a key that is no text")?;
        Ok((key, reply_value(value)?))
    });
    named.collect::<Result<_, String>>().map(ReplyValue::Map)
}

/// Returns a string that may be encoded as text or as bytes.
pub fn text(value: &Value) -> Option<String> {
    Some(std::str::from_utf8(value.as_slice()?).ok()?.to_owned())
}

pub fn kind(value: &Value) -> &'static str {
    match value {
        Value::Nil => "nil",
        Value::Boolean(_) => "boolean",
        Value::Integer(_) | Value::F32(_) | Value::F64(_) => "number",
        Value::String(_) => "text",
        Value::Binary(_) => "row of bytes",
        Value::Array(_) => "list",
        Value::Map(_) => "map",
        Value::Ext(..) => "msgpack extension",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::values::Elements;

    /// `msgpack_numpy.packb({"actions": np.float32([[1.5, -2]]), "n": np.float64(3)})` of openpi-client
    /// 0.1.2.
    const KNOWN: &[u8] = include_bytes!("known.msgpack");

    #[test]
    fn answers_of_openpi_are_read() {
        let reply = read_reply(KNOWN).unwrap();
        assert_eq!(
            reply.at("actions"),
            Some(&ReplyValue::Array { shape: vec![1, 2], values: vec![1.5, -2.0] })
        );
        assert_eq!(reply.at("n"), Some(&ReplyValue::number(3.0)));
        for end in 0..KNOWN.len() {
            assert!(read_reply(&KNOWN[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn requests_read_back_as_they_were() {
        let array = Array { shape: vec![1, 2], elements: Elements::Bytes(vec![7, 200]) };
        let request = RequestValue::Map(vec![
            ("x".into(), RequestValue::Array(array)),
            ("y".into(), RequestValue::Text("z".into())),
        ]);
        let bytes = written(&request, Dialect::Openpi);
        let reply = read_reply(&bytes).unwrap();
        assert_eq!(reply.at("x"), Some(&ReplyValue::Array { shape: vec![1, 2], values: vec![7.0, 200.0] }));
        assert_eq!(reply.at("y"), Some(&ReplyValue::Text("z".into())));
        assert!(bytes.windows(13).any(|part| part == b"\xc4\x0b__ndarray__"), "keys of arrays are bytes");
        assert!(read_reply(&[&bytes[..], b"\x01"].concat()).unwrap_err().contains("1 bytes after"));
        assert_eq!(read_reply(b"\xc3").map(|reply| reply.describe()), Ok("a boolean".into()));
    }

    /// The bytes of `msgpack.packb(x, default=msgpack_numpy.encode)` of msgpack-numpy 0.4.8, where x =
    /// {"a": np.float32([[1.5, -2]]), "n": np.float32(3)}.
    const KNOWN_PACKAGE: &[u8] = b"\x82\xa1a\x85\xc4\x02nd\xc3\xc4\x04type\xa3<f4\xc4\x04kind\xc4\x00\xc4\x05shape\x92\x01\x02\
        \xc4\x04data\xc4\x08\x00\x00\xc0?\x00\x00\x00\xc0\xa1n\x83\xc4\x02nd\xc2\xc4\x04type\xa3<f4\xc4\x04data\
        \xc4\x04\x00\x00@@";

    #[test]
    fn arrays_are_written_and_read_as_msgpack_numpy_does() {
        let reply = read_reply(KNOWN_PACKAGE).unwrap();
        let row = ReplyValue::Array { shape: vec![1, 2], values: vec![1.5, -2.0] };
        assert_eq!((reply.at("a"), reply.at("n")), (Some(&row), Some(&ReplyValue::number(3.0))));
        for end in 0..KNOWN_PACKAGE.len() {
            assert!(read_reply(&KNOWN_PACKAGE[..end]).is_err(), "{end}");
        }
        let array = Array { shape: vec![1, 2], elements: Elements::Floats(vec![1.5, -2.0]) };
        let request = RequestValue::Map(vec![("a".into(), RequestValue::Array(array))]);
        let bytes = written(&request, Dialect::MsgpackNumpy);
        let length = bytes.len();
        assert_eq!(bytes[1..], KNOWN_PACKAGE[1..length], "all but how many entries there are");
        // Arrays of objects are pickled, which is not supported.
        let pickled = [&KNOWN_PACKAGE[..15], b"\xa2|O", &KNOWN_PACKAGE[19..]].concat();
        assert!(read_reply(&pickled).unwrap_err().contains("dtype \"|O\""), "{pickled:?}");
    }
}
