//! Poses, numbers by joint, base commands, and the limits of locomotion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};
use serde_json::{Map, Value};

/// A pose in the frame that its field names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// [x, y, z] in metres.
    pub position_m: [f64; 3],
    /// [w, x, y, z], norm 1.
    pub quaternion_wxyz: [f64; 4],
}

/// One number per joint, in the robot's published joint order; a JSON object from joint name to number. JSON
/// has four decimals, for which a model reads a third of the text. MessagePack, which programs request, has
/// six.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct JointValues(pub Vec<(String, f64)>);

impl JointValues {
    /// Returns true if there are no joints.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Returns the value of one joint.
    pub fn get(&self, joint: &str) -> Option<f64> {
        self.0.iter().find(|(name, _)| name == joint).map(|(_, value)| *value)
    }
}

impl Serialize for JointValues {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let parts = if serializer.is_human_readable() { 1e4 } else { 1e6 };
        // Adding zero turns the negative zero of tiny negative values into a positive one.
        let rounded = |value: f64| (value * parts).round() / parts + 0.0;
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

/// Columns of a base command, in the order of action rows. Fields have the same names.
pub const BASE_COLUMNS: [&str; 4] = ["vx_m_s", "vy_m_s", "yaw_rate_rad_s", "pelvis_height_m"];

/// The present base command. Velocities are zero between commands; the height persists.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseCommand {
    /// Forward velocity in metres per second.
    pub vx_m_s: f64,
    /// Velocity to the left in metres per second.
    pub vy_m_s: f64,
    /// Turning rate in radians per second, counter-clockwise seen from above.
    pub yaw_rate_rad_s: f64,
    /// Height of the pelvis above the floor in metres.
    pub pelvis_height_m: f64,
}

/// Base commands that locomotion accepts; values beyond are clamped and reported.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct BaseLimits {
    /// Forward velocity.
    pub vx_m_s: Range,
    /// Velocity to the left.
    pub vy_m_s: Range,
    /// Turning rate, counter-clockwise seen from above.
    pub yaw_rate_rad_s: Range,
    /// Height of the pelvis above the floor. Where min equals max the robots cannot squat.
    pub pelvis_height_m: Range,
}

/// From `min` to `max`, both included, in the unit of its field.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Range {
    /// The smallest value accepted.
    pub min: f64,
    /// The largest value accepted.
    pub max: f64,
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_fields_are_the_columns() {
        let command = BaseCommand { vx_m_s: 0.0, vy_m_s: 0.0, yaw_rate_rad_s: 0.0, pelvis_height_m: 0.75 };
        let range = Range { min: 0.0, max: 0.0 };
        let limits =
            BaseLimits { vx_m_s: range, vy_m_s: range, yaw_rate_rad_s: range, pelvis_height_m: range };
        let names = |value: Value| -> Vec<String> {
            value.as_object().into_iter().flatten().map(|(name, _)| name.clone()).collect()
        };
        assert_eq!(names(json!(command)), BASE_COLUMNS);
        assert_eq!(names(json!(limits)), BASE_COLUMNS);
    }
}
