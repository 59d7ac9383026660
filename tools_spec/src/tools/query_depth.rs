//! `query_depth`: how far away the thing at a pixel is, and where that is for the robot's hands.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::tool::Tool;

/// Measure depth at pixels of a robot's head camera. Returns for each pixel the distance along the optical axis and the
/// 3-D point in the robot's pelvis frame, the frame that wrist targets are given in. A pixel sees a surface, so the
/// middle of an object lies a little behind the point. Costs no steps; physics stands still.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct QueryDepth {
    /// The robot whose camera measures, as "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Pixels as [u, v]: column 0 to 319 from the left, row 0 to 239 from the top, at most 256 of them.
    /// Example: [[160, 120], [170, 120]].
    #[schemars(length(min = 1, max = 256), extend("items" = limits::pixel()))]
    pub pixels: Vec<[i64; 2]>,
}

impl Tool for QueryDepth {
    type Reply = DepthReply;
    const NAME: &'static str = "query_depth";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        QueryDepth { robot: "A".into(), pixels: vec![[160, 120], [170, 120]] }
    }

    fn validate(&self) -> Result<(), String> {
        checks::pixels(&self.pixels)
    }
}

/// The reply to `query_depth`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthReply {
    /// The robot whose camera measured.
    pub robot: String,
    /// One entry per pixel asked for, in the same order.
    pub points: Vec<DepthPoint>,
}

/// What one pixel sees.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthPoint {
    /// The pixel as [u, v].
    pub pixel: [i64; 2],
    /// Distance along the optical axis in metres; null where nothing is seen.
    pub depth_m: Option<f64>,
    /// The point in the robot's pelvis frame (x forward, y left, z up) in metres; null where nothing is seen.
    pub point_in_pelvis_m: Option<[f64; 3]>,
}
