//! Values of requests and answers, independent of the protocol.

/// An array with numpy's C order.
#[derive(Clone, Debug, PartialEq)]
pub struct Array {
    pub shape: Vec<usize>,
    pub elements: Elements,
}

/// Elements of an array in a request.
#[derive(Clone, Debug, PartialEq)]
pub enum Elements {
    Bytes(Vec<u8>),
    Floats(Vec<f32>),
}

impl Array {
    /// Stacks arrays of the same shape along a new first axis.
    pub fn stack(arrays: Vec<Array>) -> Array {
        let shape = arrays.first().map(|array| array.shape.clone()).unwrap_or_default();
        let shape = std::iter::once(arrays.len()).chain(shape).collect();
        let mut joined: Option<Elements> = None;
        for Array { elements, .. } in arrays {
            match (&mut joined, elements) {
                (Some(Elements::Bytes(all)), Elements::Bytes(more)) => all.extend(more),
                (Some(Elements::Floats(all)), Elements::Floats(more)) => all.extend(more),
                (_, elements) => joined = Some(elements),
            }
        }
        Array { shape, elements: joined.unwrap_or(Elements::Floats(Vec::new())) }
    }

    /// Returns the numpy name of the element type.
    pub fn dtype(&self) -> &'static str {
        match self.elements {
            Elements::Bytes(_) => "|u1",
            Elements::Floats(_) => "<f4",
        }
    }

    /// Returns the elements as bytes, in little-endian order.
    pub fn bytes(&self) -> Vec<u8> {
        match &self.elements {
            Elements::Bytes(bytes) => bytes.clone(),
            Elements::Floats(values) => values.iter().flat_map(|value| value.to_le_bytes()).collect(),
        }
    }
}

/// A value in a request to a policy.
#[derive(Clone, Debug, PartialEq)]
pub enum RequestValue {
    Map(Vec<(String, RequestValue)>),
    Array(Array),
    Text(String),
    List(Vec<RequestValue>),
}

/// Splits a key into its parts: `video > ego_view` is the key `ego_view` in the map `video`.
pub fn path(key: &str) -> impl Iterator<Item = &str> {
    key.split('>').map(str::trim).filter(|part| !part.is_empty())
}

impl RequestValue {
    /// Stores `value` under the path `key`. Missing maps are created.
    pub fn put(&mut self, key: &str, value: RequestValue) {
        let mut at = self;
        for part in path(key) {
            let RequestValue::Map(entries) = at else { return };
            let index = entries.iter().position(|(name, _)| name == part).unwrap_or_else(|| {
                entries.push((part.into(), RequestValue::Map(Vec::new())));
                entries.len() - 1
            });
            at = &mut entries[index].1;
        }
        *at = value;
    }
}

/// A value in a policy's answer.
#[derive(Clone, Debug, PartialEq)]
pub enum ReplyValue {
    Map(Vec<(String, ReplyValue)>),
    Array {
        shape: Vec<usize>,
        values: Vec<f64>,
    },
    Text(String),
    /// A value of any other type, with a description.
    Other(String),
}

impl ReplyValue {
    /// Wraps a single number.
    pub fn number(value: f64) -> ReplyValue {
        ReplyValue::Array { shape: Vec::new(), values: vec![value] }
    }

    /// Converts a list of values. It becomes an array if all items are arrays of the same shape.
    pub fn list(items: Vec<ReplyValue>) -> ReplyValue {
        let (length, mut joined, mut inner) = (items.len(), Vec::new(), None);
        for item in items {
            match item {
                ReplyValue::Array { shape, values } if inner.as_ref().is_none_or(|known| *known == shape) => {
                    inner = Some(shape);
                    joined.extend(values);
                }
                _ => return ReplyValue::Other(format!("a list of {length} that is no array of numbers")),
            }
        }
        let shape = std::iter::once(length).chain(inner.unwrap_or_default()).collect();
        ReplyValue::Array { shape, values: joined }
    }

    /// Decodes an array from numpy's bytes.
    ///
    /// # Errors
    ///
    /// Returns a description of the invalid values.
    pub fn from_bytes(dtype: &str, shape: Vec<usize>, bytes: &[u8]) -> Result<ReplyValue, String> {
        let values: Vec<f64> = match dtype {
            "<f4" => read(bytes, |four| f32::from_le_bytes(four).into()),
            "<f8" => read(bytes, f64::from_le_bytes),
            "<i4" => read(bytes, |four| i32::from_le_bytes(four).into()),
            "<i8" => read(bytes, |eight| i64::from_le_bytes(eight) as f64),
            "|u1" => read(bytes, |one: [u8; 1]| one[0].into()),
            _ => return Err(format!("an array of dtype {dtype:?}; send \"<f4\" (float32) or \"<f8\"")),
        };
        let length = shape.iter().try_fold(1usize, |length, side| length.checked_mul(*side));
        match length == Some(values.len()) {
            true => Ok(ReplyValue::Array { shape, values }),
            false => Err(format!("an array of shape {shape:?} with {} elements", values.len())),
        }
    }

    /// Stores `value` under the path `key`. Missing maps are created. An empty path replaces the whole value.
    pub fn put(&mut self, key: &str, value: ReplyValue) {
        let mut at = self;
        for part in path(key) {
            if !matches!(at, ReplyValue::Map(_)) {
                *at = ReplyValue::Map(Vec::new());
            }
            let ReplyValue::Map(entries) = at else { return };
            let index = entries.iter().position(|(name, _)| name == part).unwrap_or_else(|| {
                entries.push((part.into(), ReplyValue::Map(Vec::new())));
                entries.len() - 1
            });
            at = &mut entries[index].1;
        }
        *at = value;
    }

    /// Returns the value under the path `key`. An empty path means the whole value.
    pub fn at(&self, key: &str) -> Option<&ReplyValue> {
        path(key).try_fold(self, |at, part| match at {
            ReplyValue::Map(entries) => entries.iter().find(|(name, _)| name == part).map(|(_, reply)| reply),
            _ => None,
        })
    }

    /// Describes the value for the author of a map.
    pub fn describe(&self) -> String {
        match self {
            ReplyValue::Map(entries) if entries.is_empty() => "an empty map".into(),
            ReplyValue::Map(entries) => {
                let parts = entries.iter().map(|(name, reply)| match reply {
                    ReplyValue::Map(_) => format!("{name:?}: {{{}}}", reply.describe()),
                    _ => format!("{name:?}: {}", reply.describe()),
                });
                parts.collect::<Vec<_>>().join(", ")
            }
            ReplyValue::Array { shape, .. } if shape.is_empty() => "a number".into(),
            ReplyValue::Array { shape, .. } => format!("an array of shape {shape:?}"),
            ReplyValue::Text(text) => format!("the text {text:?}"),
            ReplyValue::Other(what) => what.clone(),
        }
    }
}

fn read<const N: usize>(bytes: &[u8], value: impl Fn([u8; N]) -> f64) -> Vec<f64> {
    bytes.as_chunks::<N>().0.iter().map(|chunk| value(*chunk)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_lead_into_maps() {
        let mut sent = RequestValue::Map(Vec::new());
        sent.put("video > a", RequestValue::Text("1".into()));
        sent.put("video > b", RequestValue::Text("2".into()));
        sent.put("observation/state", RequestValue::Text("3".into()));
        let text = |name: &str, text: &str| (name.to_owned(), RequestValue::Text(text.into()));
        let video = RequestValue::Map(vec![text("a", "1"), text("b", "2")]);
        assert_eq!(sent, RequestValue::Map(vec![("video".into(), video), text("observation/state", "3")]));

        let reply =
            ReplyValue::Map(vec![("x".into(), ReplyValue::Map(vec![("y".into(), ReplyValue::number(4.0))]))]);
        assert_eq!(reply.at("x > y"), Some(&ReplyValue::number(4.0)));
        assert_eq!((reply.at("x > z"), reply.at("")), (None, Some(&reply)));
        assert_eq!(reply.describe(), "\"x\": {\"y\": a number}");
    }

    #[test]
    fn arrays_come_as_bytes_or_as_lists() {
        let array = |shape: &[usize], values: &[f64]| ReplyValue::Array {
            shape: shape.into(),
            values: values.into(),
        };
        let bytes: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|value| value.to_le_bytes()).collect();
        assert_eq!(ReplyValue::from_bytes("<f4", vec![1, 2], &bytes), Ok(array(&[1, 2], &[1.5, -2.0])));
        assert_eq!(ReplyValue::from_bytes("|u1", vec![2], &[7, 8]), Ok(array(&[2], &[7.0, 8.0])));
        for (dtype, shape, says) in [
            ("<f2", vec![4], "\"<f2\""),
            ("<f4", vec![3], "shape [3] with 2"),
            ("<f4", vec![usize::MAX, 2], "with 2"),
        ] {
            let text = ReplyValue::from_bytes(dtype, shape, &bytes).unwrap_err();
            assert!(text.contains(says), "{text}");
        }

        let row = |values: &[f64]| {
            ReplyValue::list(values.iter().map(|value| ReplyValue::number(*value)).collect())
        };
        assert_eq!(
            ReplyValue::list(vec![row(&[1.0, 2.0]), row(&[3.0, 4.0])]),
            array(&[2, 2], &[1.0, 2.0, 3.0, 4.0])
        );
        let ragged = ReplyValue::list(vec![row(&[1.0, 2.0]), row(&[3.0])]);
        assert_eq!(ragged.describe(), "a list of 2 that is no array of numbers");
    }
}
