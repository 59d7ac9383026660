//! Frames of points and poses.

use schemars::JsonSchema;
use serde::{Deserialize, Deserializer, Serialize};

/// A frame of a robot. The briefing at a start explains the frames, so schemas contain only their names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum PoseFrame {
    /// The robot's present pelvis frame: x forward, y left, z up. It tilts and turns with the pelvis.
    #[default]
    Pelvis,
    /// The pelvis frame, but upright: z against gravity, x along the robot's heading.
    Level,
    /// Origin on the floor below the pelvis at the episode's start; z up, x along the robot's heading at that
    /// time. It is fixed in the room, up to odometry drift.
    Start,
    /// The first robot's start frame, used for every robot, so that a place has the same coordinates for all
    /// robots.
    Room,
}

impl PoseFrame {
    /// All frames.
    const ALL: [PoseFrame; 4] = [PoseFrame::Pelvis, PoseFrame::Level, PoseFrame::Start, PoseFrame::Room];

    /// Returns true for the pelvis frame.
    pub(crate) fn is_pelvis(&self) -> bool {
        *self == PoseFrame::Pelvis
    }
}

/// Deserializes a field for which null also means its default, as in older schemas.
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
