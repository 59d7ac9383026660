//! A robot's description: a TOML file that says of somebody else's MJCF which of its joints are which of a robot's, where its wrists and
//! its camera are, and what that file does not say of its drives.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::SimError;
use crate::files::read_regular_text;

/// What the file says. Joints are called as published, but for those that are not.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotDescription {
    /// The MJCF file, from the folder of the description.
    pub model: PathBuf,
    /// The embedded robot of which joints have effort, speed limit, armature and dry friction, where nothing else says them.
    pub like: Option<String>,
    /// What the MJCF calls joints that it calls otherwise.
    #[serde(default)]
    pub joints: BTreeMap<String, String>,
    /// Joints of the MJCF that nobody moves, as it calls them, and where each stays.
    #[serde(default)]
    pub held_rad: BTreeMap<String, f64>,
    /// How waist, arms and hands are at rest, where it is not as in the MJCF's first key.
    #[serde(default)]
    pub rest_rad: BTreeMap<String, f32>,
    #[serde(default)]
    pub effort_n_m: BTreeMap<String, f32>,
    #[serde(default)]
    pub speed_limit_rad_s: BTreeMap<String, f32>,
    /// Wrists, unless the MJCF has sites `left_wrist` and `right_wrist`.
    #[serde(default)]
    pub left_wrist: Option<BodyFrame>,
    #[serde(default)]
    pub right_wrist: Option<BodyFrame>,
    /// The camera in the head, unless the MJCF has one that is called `egocentric`.
    pub camera: Option<HeadCamera>,
}

/// A frame on a body of the MJCF.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BodyFrame {
    pub body: String,
    pub position_m: [f64; 3],
    #[serde(default = "along_the_body")]
    pub quaternion_wxyz: [f64; 4],
}

/// A camera that looks ahead of a body, along its x axis, and down.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HeadCamera {
    pub body: String,
    pub position_m: [f32; 3],
    pub down_deg: f32,
}

fn along_the_body() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

impl RobotDescription {
    /// The file's content, and its text.
    pub fn read(path: &Path) -> Result<(RobotDescription, String), SimError> {
        let file = path.display().to_string();
        let text = read_regular_text(path).map_err(|source| SimError::Read { path: file.clone(), source })?;
        let description = toml::from_str(&text)
            .map_err(|source| SimError::RobotDescription { file, source: Box::new(source) })?;
        Ok((description, text))
    }
}
