//! `query_depth`: how far away the thing at a pixel is, and where that is for the robot's hands.
//! `episodes/src/observation/observer.rs` answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::PixelRegion;
use crate::tool::Tool;

/// Measure depth at pixels of a robot's head camera, named one by one or as a region: at most 256 of them either way. Returns
/// for each pixel the distance along the optical axis and the 3-D point in the robot's pelvis frame, the frame that wrist
/// targets are given in. A pixel sees a surface, so the middle of an object lies a little behind the point. Costs no steps;
/// physics stands still.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("oneOf" = limits::either("pixels", "array", "region", "object")))]
#[serde(deny_unknown_fields)]
pub struct QueryDepth {
    /// The robot whose camera measures, as "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Pixels as [u, v]: column 0 to 319 from the left, row 0 to 239 from the top, at most 256 of them.
    /// Example: [[160, 120], [170, 120]]. Null: those of `region`.
    #[schemars(length(min = 1, max = limits::MOST_PIXELS), extend("items" = limits::pixel()))]
    pub pixels: Option<Vec<[i64; 2]>>,
    /// Pixels of a rectangle, row by row, at most 256 of them. Null: those of `pixels`.
    pub region: Option<PixelRegion>,
}

impl QueryDepth {
    /// Every pixel that a call names which has been checked.
    pub fn named(&self) -> Vec<[i64; 2]> {
        let region = self.region.iter().flat_map(PixelRegion::pixels);
        self.pixels.iter().flatten().copied().chain(region).collect()
    }
}

impl Tool for QueryDepth {
    type Reply = DepthReply;
    const NAME: &'static str = "query_depth";
    const READ_ONLY: bool = true;

    fn example() -> Self {
        QueryDepth { robot: "A".into(), pixels: Some(vec![[160, 120], [170, 120]]), region: None }
    }

    fn robots(&self) -> Vec<&str> {
        vec![&self.robot]
    }

    fn validate(&self) -> Result<(), String> {
        match (&self.pixels, &self.region) {
            (Some(pixels), None) => checks::pixels(pixels),
            (None, Some(region)) => checks::region(region),
            (None, None) | (Some(_), Some(_)) => Err(
                "give either pixels, as [[160, 120]], or region, as {\"from\": [100, 80], \"to\": [220, 170], \"stride\": 10}"
                    .into(),
            ),
        }
    }
}

/// The reply to `query_depth`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthReply {
    /// The robot whose camera measured.
    pub robot: String,
    /// One entry per pixel asked for, in the same order; of a region row by row.
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
