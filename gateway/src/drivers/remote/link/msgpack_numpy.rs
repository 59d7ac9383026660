//! msgpack with arrays as openpi-client's `msgpack_numpy` writes them: a map of `__ndarray__`, `data`, `dtype` and `shape`, whose
//! keys are bytes.

use rmpv::{Value, decode, encode};

use crate::drivers::remote::values::{Array, Sent, Told};

/// As msgpack.
pub fn write(sent: &Sent) -> Vec<u8> {
    let mut bytes = Vec::new();
    // Nothing fails to be written into memory.
    let _ = encode::write_value(&mut bytes, &value(sent));
    bytes
}

fn value(sent: &Sent) -> Value {
    match sent {
        Sent::Map(entries) => {
            Value::Map(entries.iter().map(|(key, sent)| (key.as_str().into(), value(sent))).collect())
        }
        Sent::Array(array) => ndarray(array),
        Sent::Text(text) => text.as_str().into(),
        Sent::Texts(texts) => Value::Array(texts.iter().map(|text| text.as_str().into()).collect()),
    }
}

fn ndarray(array: &Array) -> Value {
    let key = |name: &str| Value::Binary(name.into());
    Value::Map(vec![
        (key("__ndarray__"), true.into()),
        (key("data"), Value::Binary(array.bytes())),
        (key("dtype"), array.dtype().into()),
        (key("shape"), Value::Array(array.shape.iter().map(|side| (*side as u64).into()).collect())),
    ])
}

/// From msgpack; lists of numbers are arrays, too.
pub fn read(mut bytes: &[u8]) -> Result<Told, String> {
    let value = decode::read_value(&mut bytes).map_err(|error| format!("no msgpack: {error}"))?;
    match bytes.is_empty() {
        true => told(value),
        false => Err(format!("{} bytes after the end of a msgpack value", bytes.len())),
    }
}

fn told(value: Value) -> Result<Told, String> {
    if let Some(number) = value.as_f64() {
        return Ok(Told::number(number));
    }
    match value {
        Value::Map(entries) => of_map(entries),
        Value::Array(items) => items.into_iter().map(told).collect::<Result<_, _>>().map(Told::list),
        Value::String(text) => Ok(Told::Text(text.as_str().unwrap_or("no UTF-8").into())),
        other => Ok(Told::Other(format!("a {}", kind(&other)))),
    }
}

fn of_map(entries: Vec<(Value, Value)>) -> Result<Told, String> {
    let find = |name: &str| {
        entries.iter().find(|(key, _)| key.as_slice() == Some(name.as_bytes())).map(|(_, value)| value)
    };
    if find("__ndarray__").is_some() {
        let shape = find("shape").and_then(Value::as_array).into_iter().flatten();
        let shape: Option<Vec<usize>> = shape.map(|side| side.as_u64()?.try_into().ok()).collect();
        let dtype = find("dtype").and_then(text).unwrap_or_default();
        let data = find("data").and_then(Value::as_slice).ok_or("an array without data")?;
        return Told::from_bytes(&dtype, shape.ok_or("an array with a side that is no number")?, data);
    }
    if find("__npgeneric__").is_some() {
        return told(find("data").cloned().unwrap_or(Value::Nil));
    }
    let named = entries.into_iter().map(|(key, value)| {
        let key = text(&key).ok_or("a key that is no text")?;
        Ok((key, told(value)?))
    });
    named.collect::<Result<_, String>>().map(Told::Map)
}

/// A text, written as text or as bytes.
fn text(value: &Value) -> Option<String> {
    Some(std::str::from_utf8(value.as_slice()?).ok()?.to_owned())
}

fn kind(value: &Value) -> &'static str {
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
    use crate::drivers::remote::values::Elements;

    /// `msgpack_numpy.packb({"actions": np.float32([[1.5, -2]]), "n": np.float64(3)})` of openpi-client 0.1.2.
    const KNOWN: &[u8] = include_bytes!("known.msgpack");

    #[test]
    fn answers_of_openpi_are_read() {
        let told = read(KNOWN).unwrap();
        assert_eq!(told.at("actions"), Some(&Told::Array { shape: vec![1, 2], values: vec![1.5, -2.0] }));
        assert_eq!(told.at("n"), Some(&Told::number(3.0)));
        for end in 0..KNOWN.len() {
            assert!(read(&KNOWN[..end]).is_err(), "{end}");
        }
    }

    #[test]
    fn requests_read_back_as_they_were() {
        let array = Array { shape: vec![1, 2], elements: Elements::Bytes(vec![7, 200]) };
        let sent = Sent::Map(vec![("x".into(), Sent::Array(array)), ("y".into(), Sent::Text("z".into()))]);
        let bytes = write(&sent);
        let told = read(&bytes).unwrap();
        assert_eq!(told.at("x"), Some(&Told::Array { shape: vec![1, 2], values: vec![7.0, 200.0] }));
        assert_eq!(told.at("y"), Some(&Told::Text("z".into())));
        assert!(bytes.windows(13).any(|part| part == b"\xc4\x0b__ndarray__"), "keys of arrays are bytes");
        assert!(read(&[&bytes[..], b"\x01"].concat()).unwrap_err().contains("1 bytes after"));
        assert_eq!(read(b"\xc3").map(|told| told.describe()), Ok("a boolean".into()));
    }
}
