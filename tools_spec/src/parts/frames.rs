//! The frames that points and poses may be given in.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// A frame of a robot. The brief of a start says what each is, so schemas name them only.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseFrame {
    /// In the robot's pelvis as it is at that moment: x forward, y left, z up. It leans and turns with the
    /// pelvis.
    #[default]
    Pelvis,
    /// In the pelvis, but upright: z against gravity, x the way that the robot faces.
    Level,
    /// On the floor under the pelvis as it was when the episode began, z up, x where the robot faced: it
    /// stays in the room while the robot moves, as far as its odometry is right.
    Start,
    /// The first robot's start frame, for every robot: a place in the room is the same to all of them.
    Room,
}

impl PoseFrame {
    /// Every frame.
    const ALL: [PoseFrame; 4] = [PoseFrame::Pelvis, PoseFrame::Level, PoseFrame::Start, PoseFrame::Room];

    /// Returns true for the pelvis frame.
    pub(crate) fn is_pelvis(&self) -> bool {
        *self == PoseFrame::Pelvis
    }
}

/// Reads a field for which null stands for its default, too, as older schemas have it.
pub fn null_is_default<'de, D, T>(deserializer: D) -> Result<T, D::Error>
where
    D: Deserializer<'de>,
    T: Deserialize<'de> + Default,
{
    Ok(Option::deserialize(deserializer)?.unwrap_or_default())
}

impl JsonSchema for PoseFrame {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "PoseFrame".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "enum": PoseFrame::ALL })
    }
}
