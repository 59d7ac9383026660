//! A robot's description: a TOML file that adapts third-party MJCF. It maps the joints of the MJCF to those
//! of a robot, defines wrists and camera, and adds drive data that the MJCF lacks.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use serde::Deserialize;

use crate::SimError;
use crate::user_file::{MAX_TEXT_BYTES, read_text};

/// Content of the file. Joints have their published names, except where stated otherwise.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct RobotDescription {
    /// The MJCF file, relative to the folder of the description.
    pub model: PathBuf,
    /// Embedded robot that supplies missing efforts, speed limits, armatures and dry frictions of joints.
    pub like: Option<String>,
    /// Names of joints in the MJCF that differ from the published names, by published name.
    #[serde(default)]
    pub joints: BTreeMap<String, String>,
    /// Fixed angles of MJCF joints that are not moved, by their MJCF names.
    #[serde(default)]
    pub held_rad: BTreeMap<String, f64>,
    /// Rest angles of waist, arms and hands that differ from the MJCF's first key.
    #[serde(default)]
    pub rest_rad: BTreeMap<String, f32>,
    /// Ranges of joints that differ from the MJCF's.
    #[serde(default)]
    pub range_rad: BTreeMap<String, [f64; 2]>,
    #[serde(default)]
    pub effort_n_m: BTreeMap<String, f32>,
    #[serde(default)]
    pub speed_limit_rad_s: BTreeMap<String, f32>,
    /// Frames of the wrists, unless the MJCF has sites `left_wrist` and `right_wrist`.
    #[serde(default)]
    pub left_wrist: Option<BodyFrame>,
    #[serde(default)]
    pub right_wrist: Option<BodyFrame>,
    /// The camera in the head, unless the MJCF has one named `egocentric`.
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

/// A camera that looks along the x axis of a body, tilted down.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct HeadCamera {
    pub body: String,
    pub position_m: [f32; 3],
    pub down_deg: f32,
}

impl BodyFrame {
    /// Creates the frame of a body itself.
    pub fn at(body: String) -> BodyFrame {
        BodyFrame { body, position_m: [0.0; 3], quaternion_wxyz: along_the_body() }
    }
}

fn along_the_body() -> [f64; 4] {
    [1.0, 0.0, 0.0, 0.0]
}

impl RobotDescription {
    /// Reads the file. Returns its content and its text.
    pub fn read(path: &Path) -> Result<(RobotDescription, String), SimError> {
        let file = path.display().to_string();
        let text = read_text(path, MAX_TEXT_BYTES)
            .map_err(|source| SimError::Read { path: file.clone(), source })?;
        let description = toml::from_str(&text)
            .map_err(|source| SimError::RobotDescription { file, source: Box::new(source) })?;
        Ok((description, text))
    }
}
