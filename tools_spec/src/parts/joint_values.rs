//! Numbers by joint.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};
use serde_json::{Map, Value};

/// One number per joint, in the robot's published joint order; JSON object from joint name to number. JSON carries them
/// to six decimals: the drives measure no finer, and a model reads a third of the text.
#[derive(Debug, Clone, PartialEq)]
pub struct JointValues(pub Vec<(String, f64)>);

impl JointValues {
    /// The value of one joint.
    pub fn get(&self, joint: &str) -> Option<f64> {
        self.0.iter().find(|(name, _)| name == joint).map(|(_, value)| *value)
    }
}

impl Serialize for JointValues {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        // Adding zero makes the zero of tiny negative values a positive one.
        let rounded = |value: f64| (value * 1e6).round() / 1e6 + 0.0;
        serializer.collect_map(self.0.iter().map(|(name, value)| (name, rounded(*value))))
    }
}

impl<'de> Deserialize<'de> for JointValues {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let object = Map::<String, Value>::deserialize(deserializer)?;
        let number = |(name, value): (String, Value)| match value.as_f64() {
            Some(value) => Ok((name, value)),
            None => Err(D::Error::custom(format!("joint {name} holds {value}; expected a number"))),
        };
        object.into_iter().map(number).collect::<Result<_, _>>().map(JointValues)
    }
}

impl JsonSchema for JointValues {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "JointValues".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "object", "additionalProperties": { "type": "number" } })
    }
}
