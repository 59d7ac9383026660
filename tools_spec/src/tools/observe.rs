//! `observe`: images and sensor readings of the robots. `episodes/src/observation/observer.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize, ser::SerializeStruct};

use super::get_robot_state::RobotState;
use crate::checks;
use crate::limits;
use crate::parts::{CameraArrays, Png, Pose, PoseFrame};
use crate::tool::Tool;

/// Look through head cameras: one PNG image of 320x240 pixels for each robot, its camera's
/// calibration and the numbers of get_robot_state. Costs no steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Observe {
    /// Robots, for example ["A", "B"]. Null: all.
    #[schemars(
        length(min = 1, max = limits::ROBOT_NAMES.len()),
        inner(regex(pattern = limits::ROBOT_PATTERN)),
        extend("uniqueItems" = true)
    )]
    pub robots: Option<Vec<String>>,
    /// True: without joint angles, velocities and torques, most of the text.
    #[schemars(extend("paper" = "True: without joint angles, most of the text.", "default" = false))]
    pub short: Option<bool>,
    /// Frame of the wrists and of an additional camera pose.
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: Option<PoseFrame>,
    /// True: also a grey image of depth.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("full_only" = true, "default" = false))]
    pub depth_image: bool,
}

impl Observe {
    /// Returns a full observation of all robots.
    pub fn of_all() -> Observe {
        Observe { robots: None, short: None, frame: None, depth_image: false }
    }
}

impl Tool for Observe {
    type Reply = Observation;
    const NAME: &'static str = "observe";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        Observe { robots: Some(vec!["A".into()]), short: Some(true), ..Observe::of_all() }
    }

    fn robots(&self) -> Vec<&str> {
        self.robots.iter().flatten().map(String::as_str).collect()
    }

    fn validate(&self) -> Result<(), String> {
        match self.robots {
            Some(_) => checks::robots(&self.robots()),
            None => Ok(()),
        }
    }
}

/// The reply to `observe`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Observation {
    /// Simulated seconds since the episode began.
    pub time_s: f64,
    /// Proprioception, one entry per observed robot.
    pub states: Vec<RobotState>,
    /// Camera calibration, one entry per observed robot.
    pub cameras: Vec<CameraCalibration>,
    /// The images, in the order of `cameras`. Over MCP they follow as image blocks and are left out here.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub images: Vec<CameraImage>,
    /// Links to the images, in the order of `cameras`, where `images` was "link"; left out otherwise. Over
    /// MCP they follow as links to resources, too.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub links: Vec<ImageLink>,
    /// Images of depth, in the same order, where `depth_image` was true; left out otherwise. Over MCP they
    /// follow the images as image blocks.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub depth_images: Vec<DepthImage>,
    /// Arrays requested by a program in addition to PNGs or instead, one entry per robot; left out otherwise.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub arrays: Vec<CameraArrays>,
}

/// A pinhole camera: a point (x, y, z) in the camera's frame is seen at u = fx x / z + cx, v = fy y / z + cy.
/// Axes: x right, y down, z forward (OpenCV's). Pixel (0, 0) is the top left one and its centre is at u = v =
/// 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraCalibration {
    /// The robot whose head carries it.
    pub robot: String,
    /// Pixels across.
    pub width: u32,
    /// Pixels down.
    pub height: u32,
    /// Focal length across, in pixels.
    pub fx: f64,
    /// Focal length down, in pixels.
    pub fy: f64,
    /// Column of the optical axis, in pixels.
    pub cx: f64,
    /// Row of the optical axis, in pixels.
    pub cy: f64,
    /// Pose of the camera's frame in the robot's pelvis frame (x forward, y left, z up).
    pub camera_in_pelvis: Pose,
    /// The same in the frame that the call named; left out where it named none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub camera_in_frame: Option<Pose>,
    /// Distortion of its lens; left out where it has none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub distortion: Option<LensDistortion>,
}

/// Brown-Conrady distortion of a lens: OpenCV's `projectPoints` defines x' and y', which replace x / z and y
/// / z. Points of query_depth need no correction.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct LensDistortion {
    /// Name of the model: "brown_conrady".
    pub model: String,
    /// Its coefficients, in the order of OpenCV: k1, k2, p1, p2, k3.
    pub coefficients: [f64; 5],
}

/// One image. In MessagePack, the field is `png` with raw bytes.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
pub struct CameraImage {
    /// The robot whose head camera took it.
    pub robot: String,
    /// The image.
    pub png_base64: Png,
}

/// Link to one image.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct ImageLink {
    /// The robot whose head camera took it.
    pub robot: String,
    /// Path of the PNG file on this server, for callers that may play the episode. The latest 24 of an
    /// episode are kept.
    pub path: String,
}

impl Serialize for CameraImage {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let file = if serializer.is_human_readable() { "png_base64" } else { "png" };
        let mut image = serializer.serialize_struct("CameraImage", 2)?;
        image.serialize_field("robot", &self.robot)?;
        image.serialize_field(file, &self.png_base64)?;
        image.end()
    }
}

/// Depth of one image as a grey image of the same size: its brightness is linear in 1 / depth. In
/// MessagePack, the field is `png` with raw bytes.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
pub struct DepthImage {
    /// The robot whose head camera measured.
    pub robot: String,
    /// Depth along the optical axis that is white (255), in metres; nearer points are white, too.
    pub white_m: f64,
    /// Depth that is black (0), like farther or missing points. Grey g is at the depth 1 / (1 / black_m + g /
    /// 255 (1 / white_m - 1 / black_m)).
    pub black_m: f64,
    /// The image.
    pub png_base64: Png,
}

impl Serialize for DepthImage {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let file = if serializer.is_human_readable() { "png_base64" } else { "png" };
        let mut image = serializer.serialize_struct("DepthImage", 4)?;
        image.serialize_field("robot", &self.robot)?;
        image.serialize_field("white_m", &self.white_m)?;
        image.serialize_field("black_m", &self.black_m)?;
        image.serialize_field(file, &self.png_base64)?;
        image.end()
    }
}
