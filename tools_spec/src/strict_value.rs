//! JSON interpreted like JSON Schema, which differs from serde: an array is not an object, and `1.0` is an
//! integer.

use serde::de::value::{MapDeserializer, SeqDeserializer};
use serde::de::{Deserializer, Error as _, IntoDeserializer, Unexpected, Visitor};
use serde::forward_to_deserialize_any;
use serde_json::{Error, Value};

/// Largest number up to which a double represents every integer.
const LARGEST_EXACT: f64 = 9_007_199_254_740_992.0;

/// Arguments to be deserialized into a type.
pub struct StrictValue(pub Value);

impl<'de> IntoDeserializer<'de, Error> for StrictValue {
    type Deserializer = StrictValue;

    fn into_deserializer(self) -> StrictValue {
        self
    }
}

/// Converts a number without a fraction to an integer.
fn integer(value: Value) -> Value {
    match value.as_f64() {
        Some(number) if value.is_f64() && number.fract() == 0.0 && number.abs() <= LARGEST_EXACT => {
            (number as i64).into()
        }
        _ => value,
    }
}

macro_rules! integers {
    ($($method:ident)*) => {
        $(
            fn $method<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
                integer(self.0).deserialize_any(visitor)
            }
        )*
    };
}

impl<'de> Deserializer<'de> for StrictValue {
    type Error = Error;

    fn deserialize_any<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Array(items) => {
                let mut items = SeqDeserializer::new(items.into_iter().map(StrictValue));
                let value = visitor.visit_seq(&mut items)?;
                items.end()?;
                Ok(value)
            }
            Value::Object(fields) => {
                let fields = fields.into_iter().map(|(name, value)| (name, StrictValue(value)));
                let mut fields = MapDeserializer::new(fields);
                let value = visitor.visit_map(&mut fields)?;
                fields.end()?;
                Ok(value)
            }
            scalar => scalar.deserialize_any(visitor),
        }
    }

    fn deserialize_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        _: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        match self.0 {
            // Serde would interpret the items as the fields, in order.
            Value::Array(_) => Err(Error::invalid_type(Unexpected::Seq, &"an object")),
            Value::Null => Err(Error::invalid_type(Unexpected::Unit, &"an object")),
            _ => self.deserialize_any(visitor),
        }
    }

    fn deserialize_option<V: Visitor<'de>>(self, visitor: V) -> Result<V::Value, Error> {
        match self.0 {
            Value::Null => visitor.visit_none(),
            _ => visitor.visit_some(self),
        }
    }

    fn deserialize_newtype_struct<V: Visitor<'de>>(
        self,
        _: &'static str,
        visitor: V,
    ) -> Result<V::Value, Error> {
        visitor.visit_newtype_struct(self)
    }

    fn deserialize_enum<V: Visitor<'de>>(
        self,
        name: &'static str,
        variants: &'static [&'static str],
        visitor: V,
    ) -> Result<V::Value, Error> {
        self.0.deserialize_enum(name, variants, visitor)
    }

    integers! {
        deserialize_i8 deserialize_i16 deserialize_i32 deserialize_i64 deserialize_i128
        deserialize_u8 deserialize_u16 deserialize_u32 deserialize_u64 deserialize_u128
    }

    forward_to_deserialize_any! {
        bool f32 f64 char str string bytes byte_buf unit unit_struct seq tuple tuple_struct map identifier ignored_any
    }
}

#[cfg(test)]
mod tests {
    use serde::Deserialize;
    use serde_json::json;

    use super::*;

    #[derive(Debug, PartialEq, Deserialize)]
    struct Robot {
        name: String,
        steps: u32,
        pixels: Option<Vec<[i64; 2]>>,
        height_m: Option<f64>,
        inner: Option<Box<Robot>>,
    }

    fn read(value: Value) -> Result<Robot, String> {
        Robot::deserialize(StrictValue(value)).map_err(|error| error.to_string())
    }

    #[test]
    fn integers_may_be_written_with_a_point() {
        let robot =
            read(json!({ "name": "A", "steps": 5.0, "pixels": [[1e1, -2.0]], "height_m": 1 })).unwrap();
        assert_eq!((robot.steps, robot.pixels, robot.height_m), (5, Some(vec![[10, -2]]), Some(1.0)));
        for steps in [json!(5.5), json!(-1.0), json!(1e300), json!("5"), json!(null), json!(true)] {
            assert!(read(json!({ "name": "A", "steps": steps })).is_err(), "{steps}");
        }
    }

    #[test]
    fn an_array_is_no_object_on_any_level() {
        let whole = json!(["A", 5, null, null, null]);
        for value in [whole.clone(), json!({ "name": "A", "steps": 5, "inner": whole })] {
            let text = read(value).unwrap_err();
            assert_eq!(text, "invalid type: sequence, expected an object");
        }
        assert!(read(json!({ "name": "A", "steps": 5, "inner": { "name": "B", "steps": 6 } })).is_ok());
    }

    #[test]
    fn arrays_have_the_length_that_the_type_says() {
        for pixels in [json!([[1]]), json!([[1, 2, 3]])] {
            assert!(read(json!({ "name": "A", "steps": 5, "pixels": pixels })).is_err(), "{pixels}");
        }
    }
}
