//! `query_depth`: measures points, surfaces and planes at pixels. `episodes/src/observation/observer.rs`
//! answers it.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::checks;
use crate::limits;
use crate::parts::{PixelRegion, PoseFrame, null_is_default};
use crate::tool::Tool;

/// Measure the points that a robot's head camera sees at up to 4096 pixels, listed or filling a region.
/// Returns a row [u, v, x, y, z] for each, in the pelvis frame as wrist targets. A pixel sees a surface;
/// the middle of an object is a little behind it. Costs no steps.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(extend("oneOf" = limits::one_of(&[("pixels", "array"), ("region", "object"), ("surface", "object")])))]
#[serde(deny_unknown_fields)]
pub struct QueryDepth {
    /// The robot, for example "A".
    #[schemars(extend("pattern" = limits::ROBOT_PATTERN))]
    pub robot: String,
    /// Pixels [u, v], column 0 to 319 from the left, row 0 to 239 from the top.
    #[schemars(length(min = 1, max = limits::MAX_PIXELS), extend("items" = limits::pixel()))]
    pub pixels: Option<Vec<[i64; 2]>>,
    /// Pixels of a rectangle, row by row.
    pub region: Option<PixelRegion>,
    /// True: the largest plane in `region`, its straight edges and corners in place of points.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    #[schemars(extend("full_only" = true, "default" = false))]
    pub fit: bool,
    /// Middle, size, corners and, for an upright round object, axis of a surface in place of points.
    #[schemars(extend("full_only" = true))]
    pub surface: Option<SurfaceQuery>,
    /// Frame of the points.
    #[serde(default, deserialize_with = "null_is_default", skip_serializing_if = "PoseFrame::is_pelvis")]
    #[schemars(extend("full_only" = true, "default" = PoseFrame::Pelvis))]
    pub frame: PoseFrame,
}

impl QueryDepth {
    /// Returns every pixel that the call names. The call must have been checked.
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
        QueryDepth {
            robot: "A".into(),
            pixels: Some(vec![[160, 120], [170, 120]]),
            region: None,
            fit: false,
            surface: None,
            frame: PoseFrame::Pelvis,
        }
    }

    fn robots(&self) -> Vec<&str> {
        vec![&self.robot]
    }

    fn validate(&self) -> Result<(), String> {
        if self.fit && self.region.is_none() {
            return Err("fit is of a region; give region, for example {\"from\": [100, 80], \"to\": [220, 170], \"stride\": 10}".into());
        }
        match (&self.pixels, &self.region, &self.surface) {
            (Some(pixels), None, None) => checks::pixels(pixels),
            (None, Some(region), None) => checks::region(region),
            (None, None, Some(surface)) => surface.validate(),
            _ => Err(
                "give either pixels, for example [[160, 120]], or region, for example {\"from\": [100, 80], \"to\": [220, 170], \"stride\": 10}, or \
                 surface, for example {\"pixel\": [160, 120]}"
                    .into(),
            ),
        }
    }
}

/// Give one of these.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(extend("oneOf" = limits::one_of(&[("pixel", "array"), ("color", "string"), ("object", "string")])))]
pub struct SurfaceQuery {
    /// A pixel on it: for the patch of its colour and the whole thing.
    #[schemars(extend("prefixItems" = limits::pixel_range()))]
    pub pixel: Option<[i64; 2]>,
    /// Its colour: for the nearest three.
    pub color: Option<Color>,
    /// An object of the task: for all that is seen of it; "all": for each object.
    pub object: Option<String>,
}

impl SurfaceQuery {
    /// Name for every object of the task.
    pub const ALL: &str = "all";

    fn validate(&self) -> Result<(), String> {
        let given = [self.pixel.is_some(), self.color.is_some(), self.object.is_some()];
        match given.iter().filter(|is_given| **is_given).count() {
            1 => Ok(()),
            _ => Err(
                "give either surface.pixel, for example [160, 120], or surface.color, for example \"red\", or surface.object, for \
                 example \"bottle\""
                    .into(),
            ),
        }
    }
}

/// A colour by name.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[allow(missing_docs, reason = "colours are called what they are")]
pub enum Color {
    Red,
    Orange,
    Brown,
    Yellow,
    Green,
    Blue,
    Violet,
    White,
    Grey,
    Black,
}

impl Color {
    /// Every colour.
    pub const ALL: [Color; 10] = [
        Color::Red,
        Color::Orange,
        Color::Brown,
        Color::Yellow,
        Color::Green,
        Color::Blue,
        Color::Violet,
        Color::White,
        Color::Grey,
        Color::Black,
    ];
}

impl JsonSchema for Color {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Color".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "enum": Color::ALL })
    }
}

/// Criterion that joins pixels to a surface. Neighbours have about the same depth, except for `object`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum JoinedBy {
    /// Similar colour; for a requested colour, all of it on one object.
    Color,
    /// Shape, regardless of colour: across convex edges but not concave ones, such as between an object and
    /// its table.
    Shape,
    /// The named object, regardless of colours and occlusion. The simulator knows its pixels.
    Object,
}

/// Axis of an upright round object, such as a bottle.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct UprightAxis {
    /// Its lower visible end, [x, y, z] in metres in the frame of the reply.
    pub bottom_m: [f64; 3],
    /// Its upper end.
    pub top_m: [f64; 3],
    /// The radius of most of it, in metres.
    pub radius_m: f64,
}

/// The visible part of a surface; of an object only its near side.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Surface {
    /// The object, if the call named "all"; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub object: Option<String>,
    /// Criterion for its pixels.
    pub joined_by: JoinedBy,
    /// Number of its pixels.
    pub pixels: u32,
    /// Top left of its bounding box, as [u, v].
    pub from: [i64; 2],
    /// Bottom right.
    pub to: [i64; 2],
    /// Its mean colour, [red, green, blue] from 0 to 255.
    pub rgb: [u8; 3],
    /// The middle of its area, in metres in the frame of the reply.
    pub centroid_m: [f64; 3],
    /// Middle of its box along that frame's axes: the object's own if it is fully visible.
    pub middle_m: [f64; 3],
    /// Size of that box along each axis, in metres.
    pub extent_m: [f64; 3],
    /// The four points of its outline that span the largest area in the picture, in the order of the outline:
    /// a rectangle's corners. Left out of a short reply with an axis, and for "all".
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub corners_m: Vec<[f64; 3]>,
    /// Its axis, where it is upright and round; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub axis: Option<UprightAxis>,
    /// True if it extends beyond the image.
    pub cut_off: bool,
}

/// The largest plane in a region of a picture.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PlaneFit {
    /// The middle of its points, in metres in the frame of the reply.
    pub point_m: [f64; 3],
    /// Unit normal towards the camera, in that frame.
    pub normal: [f64; 3],
    /// Root mean square distance of its points, in metres.
    pub rms_m: f64,
    /// Number of the region's pixels that see it.
    pub pixels: u32,
    /// Their share of the pixels with depth.
    pub share: f64,
}

/// A straight edge at which the plane ends within the region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EdgeFit {
    /// One end of its visible part, in metres in the frame of the reply.
    pub from_m: [f64; 3],
    /// The other end.
    pub to_m: [f64; 3],
    /// Root mean square distance of its points, in metres.
    pub rms_m: f64,
    /// Number of points that it was fitted to.
    pub points: u32,
}

/// Result of `fit` in a region.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct RegionFit {
    /// The largest plane.
    pub plane: PlaneFit,
    /// Its straight edges, the longest first, up to four. An edge may be due to occlusion.
    pub edges: Vec<EdgeFit>,
    /// Corners at which two edges meet, in metres in the frame of the reply.
    pub corners_m: Vec<[f64; 3]>,
}

/// The reply to `query_depth`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct DepthReply {
    /// The robot whose camera measured.
    pub robot: String,
    /// Frame of the points, if the call named another than the pelvis; left out otherwise.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub frame: Option<PoseFrame>,
    /// The surfaces found: at a pixel, the patch of its colour and, if larger, the whole object; for a colour
    /// up to three, the nearest first and parts of the room last; for an object one; for "all" one for each
    /// visible object. Left out where none was requested.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub surfaces: Vec<Surface>,
    /// Plane, edges and corners of the region; left out unless `fit` was requested.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fit: Option<RegionFit>,
    /// Columns of `points`: "u", "v", "x_m", "y_m", "z_m". Left out of a short reply without points.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub columns: Vec<String>,
    /// One row per requested pixel, in order; a region's row by row. Rounded to 1 mm; null where nothing is
    /// seen, or the camera has no depth. Left out with surfaces or a fit.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub points: Vec<DepthRow>,
}

impl DepthReply {
    /// Names of the columns.
    pub const COLUMNS: [&str; 5] = ["u", "v", "x_m", "y_m", "z_m"];
}

/// A pixel and the point that it sees: [u, v, x, y, z].
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct DepthRow(pub i64, pub i64, pub Option<f64>, pub Option<f64>, pub Option<f64>);

impl JsonSchema for DepthRow {
    fn inline_schema() -> bool {
        true
    }

    fn schema_name() -> std::borrow::Cow<'static, str> {
        "DepthRow".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        let cell = serde_json::json!({ "type": ["number", "null"] });
        schemars::json_schema!({ "type": "array", "items": cell, "minItems": 5, "maxItems": 5 })
    }
}

impl DepthRow {
    /// Returns the row of a pixel that sees `point_m`.
    pub fn new([u, v]: [i64; 2], point_m: Option<[f64; 3]>) -> DepthRow {
        let [x_m, y_m, z_m] = point_m.map_or([None; 3], |point_m| point_m.map(Some));
        DepthRow(u, v, x_m, y_m, z_m)
    }

    /// Returns the point, if the pixel sees one.
    pub fn point_m(&self) -> Option<[f64; 3]> {
        Some([self.2?, self.3?, self.4?])
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Value, json};

    use super::*;
    use crate::tool::parse_args;

    fn read(args: Value) -> Result<QueryDepth, String> {
        parse_args(args).map_err(|error| error.to_string())
    }

    #[test]
    fn a_surface_is_named_in_one_way() {
        let of = |surface: Value| read(json!({ "robot": "A", "surface": surface }));
        for surface in
            [json!({ "pixel": [160, 120] }), json!({ "color": "red" }), json!({ "object": "bottle" })]
        {
            assert!(of(surface.clone()).is_ok(), "{surface}");
        }
        for surface in [json!({}), json!({ "color": "red", "object": "bottle" })] {
            assert!(of(surface).unwrap_err().contains("example \"bottle\""));
        }
    }

    /// Earlier recordings and schemas have null.
    #[test]
    fn a_frame_of_null_is_the_pelvis() {
        let pixel = json!([[160, 120]]);
        for frame in [json!(null), json!("pelvis")] {
            let query = read(json!({ "robot": "A", "pixels": pixel, "frame": frame })).unwrap();
            assert_eq!((query.frame, json!(query).get("frame")), (PoseFrame::Pelvis, None));
        }
        let query = read(json!({ "robot": "A", "pixels": pixel, "frame": "room" })).unwrap();
        assert_eq!(json!(query)["frame"], "room");
    }
}
