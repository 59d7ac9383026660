//! JSON with arrays as the Python package `json_numpy` writes them: `{"__numpy__": base64, "dtype": "<f4", "shape": [2, 3]}`.

use base64::{Engine, prelude::BASE64_STANDARD};
use serde_json::{Value, json};

use crate::drivers::remote::values::{Sent, Told};

/// As JSON.
pub fn write(sent: &Sent) -> Value {
    match sent {
        Sent::Map(entries) => entries.iter().map(|(key, sent)| (key.clone(), write(sent))).collect(),
        Sent::Array(array) => json!({
            "__numpy__": BASE64_STANDARD.encode(array.bytes()),
            "dtype": array.dtype(),
            "shape": array.shape,
        }),
        Sent::Text(text) => json!(text),
        Sent::Texts(texts) => json!(texts),
    }
}

/// From JSON; lists of numbers are arrays, too.
pub fn read(value: Value) -> Result<Told, String> {
    match value {
        Value::Object(object) if object.contains_key("__numpy__") => {
            let text = |key: &str| object.get(key).and_then(Value::as_str).unwrap_or_default();
            let shape = object.get("shape").cloned().unwrap_or_default();
            let shape = serde_json::from_value(shape).map_err(|_| "an array without a shape".to_owned())?;
            let bytes = BASE64_STANDARD.decode(text("__numpy__")).map_err(|error| error.to_string())?;
            Told::from_bytes(text("dtype"), shape, &bytes)
        }
        Value::Object(object) => {
            let entries = object.into_iter().map(|(key, value)| Ok((key, read(value)?)));
            entries.collect::<Result<_, String>>().map(Told::Map)
        }
        Value::Array(items) => items.into_iter().map(read).collect::<Result<_, _>>().map(Told::list),
        // Python writes NaN as no JSON; `null` is what others make of it.
        Value::Null => Ok(Told::number(f64::NAN)),
        Value::Number(number) => Ok(Told::number(number.as_f64().unwrap_or(f64::NAN))),
        Value::String(text) => Ok(Told::Text(text)),
        Value::Bool(value) => Ok(Told::Other(value.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drivers::remote::values::{Array, Elements};

    #[test]
    fn arrays_are_written_and_read_as_json_numpy_does() {
        let array = Array { shape: vec![1, 2], elements: Elements::Floats(vec![1.5, -2.0]) };
        let sent =
            Sent::Map(vec![("x".into(), Sent::Array(array)), ("y".into(), Sent::Texts(vec!["z".into()]))]);
        let value = write(&sent);
        // json_numpy.dumps(np.float32([[1.5, -2]]))
        let known = json!({ "__numpy__": "AADAPwAAAMA=", "dtype": "<f4", "shape": [1, 2] });
        assert_eq!(value, json!({ "x": known, "y": ["z"] }));
        let told = Told::Array { shape: vec![1, 2], values: vec![1.5, -2.0] };
        assert_eq!(read(known), Ok(told.clone()));
        assert_eq!(read(json!([[1.5, -2]])), Ok(told));
    }

    #[test]
    fn what_is_no_array_is_told_in_words() {
        let check = |value: Value, says: &str| {
            let told = read(value).map_or_else(|error| error, |told| told.describe());
            assert!(told.contains(says), "{told}");
        };
        check(json!("error"), "the text \"error\"");
        check(json!([1, "a"]), "a list of 2");
        check(json!({ "__numpy__": "AADAPw==", "dtype": "<f2", "shape": [2] }), "dtype \"<f2\"");
        check(json!({ "__numpy__": "AADAPw==", "dtype": "<f4" }), "without a shape");
        check(json!({ "__numpy__": 7, "dtype": "<f4", "shape": [1] }), "shape [1] with 0");
        check(json!({ "__numpy__": "?", "dtype": "<f4", "shape": [1] }), "Invalid");
    }
}
