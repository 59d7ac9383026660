//! Images in JSON and MessagePack: formats for programs, and regions of pixels.

use base64::{Engine, prelude::BASE64_STANDARD};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};

use crate::limits;

/// Formats of an observation's images.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Formats {
    /// "png"; "rgb" for row-major pixel bytes in `arrays`; or "link" for paths of PNG files in `links`. Null:
    /// "png".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageFormat>,
    /// Depth along the optical axis at every pixel, in `arrays`: "float16" for little-endian numbers in
    /// metres, infinite where nothing is; "png16" for a PNG of 16 bits in millimetres, 0 where nothing is.
    /// Under the benchmark protocol only. Null: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthFormat>,
}

impl Formats {
    /// Names of the fields in JSON.
    pub const FIELDS: [&str; 2] = ["images", "depth"];
}

/// Format of colour images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageFormat {
    /// A PNG file.
    Png,
    /// Three bytes a pixel.
    Rgb,
    /// Path of the PNG file on the server.
    Link,
}

/// Format of depth images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DepthFormat {
    /// Half-precision numbers in metres.
    Float16,
    /// A PNG file, in millimetres.
    Png16,
}

/// A PNG file; base64 in JSON, raw bytes in MessagePack.
#[derive(Debug, Clone, PartialEq)]
pub struct Png(pub Vec<u8>);

impl Png {
    /// Returns the file as base64, which JSON and MCP use.
    pub fn to_base64(&self) -> String {
        BASE64_STANDARD.encode(&self.0)
    }
}

impl Serialize for Png {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match serializer.is_human_readable() {
            true => serializer.serialize_str(&self.to_base64()),
            false => serializer.serialize_bytes(&self.0),
        }
    }
}

impl<'de> Deserialize<'de> for Png {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        BASE64_STANDARD.decode(String::deserialize(deserializer)?).map(Png).map_err(D::Error::custom)
    }
}

impl JsonSchema for Png {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Png".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "contentEncoding": "base64", "contentMediaType": "image/png" })
    }
}

/// Bytes; base64 in JSON, raw bytes in MessagePack.
#[derive(Debug, Clone, PartialEq)]
pub struct Bytes(pub Vec<u8>);

impl Serialize for Bytes {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match serializer.is_human_readable() {
            true => serializer.serialize_str(&BASE64_STANDARD.encode(&self.0)),
            false => serializer.serialize_bytes(&self.0),
        }
    }
}

impl<'de> Deserialize<'de> for Bytes {
    fn deserialize<D: serde::Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        BASE64_STANDARD.decode(String::deserialize(deserializer)?).map(Bytes).map_err(D::Error::custom)
    }
}

impl JsonSchema for Bytes {
    fn schema_name() -> std::borrow::Cow<'static, str> {
        "Bytes".into()
    }

    fn json_schema(_: &mut schemars::SchemaGenerator) -> schemars::Schema {
        schemars::json_schema!({ "type": "string", "contentEncoding": "base64" })
    }
}

/// Pixels of one camera, row by row from the top left. The calibration has their size.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraArrays {
    /// The robot whose head camera it is.
    pub robot: String,
    /// Three bytes a pixel, red, green, blue, where `images` was "rgb". Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rgb: Option<Bytes>,
    /// Distances along the optical axis in metres, little-endian numbers of half precision, infinite where
    /// nothing is or the camera has no depth; where `depth` was "float16". Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_float16: Option<Bytes>,
    /// The same in millimetres as a PNG of 16 bits, 0 where there is no depth or it exceeds 65.535 m; where
    /// `depth` was "png16". Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_png16: Option<Bytes>,
}

/// Pixels of a rectangle at a stride, beginning at `from`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PixelRegion {
    /// Top left [u, v], such as [100, 80].
    #[schemars(extend("prefixItems" = limits::pixel_range()))]
    pub from: [i64; 2],
    /// Bottom right, such as [220, 170].
    #[schemars(extend("prefixItems" = limits::pixel_range()))]
    pub to: [i64; 2],
    /// 10: every tenth pixel across and down. Each is 30 bytes of the reply.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub stride: u32,
}

impl PixelRegion {
    /// Returns the number of pixels in the rectangle with the given stride, which must not be zero.
    pub(crate) fn count(&self, stride: u32) -> u128 {
        let along = |axis: usize| u128::from(self.from[axis].abs_diff(self.to[axis]) / u64::from(stride)) + 1;
        along(0).saturating_mul(along(1))
    }

    /// Returns the pixels in the region, row by row. Check their number first.
    pub(crate) fn pixels(&self) -> Vec<[i64; 2]> {
        let along = |axis: usize| {
            let ends = [self.from[axis].min(self.to[axis]), self.from[axis].max(self.to[axis])];
            (ends[0]..=ends[1]).step_by(self.stride.max(1) as usize)
        };
        along(1).flat_map(|v| along(0).map(move |u| [u, v])).collect()
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn the_fields_are_those_of_the_type() {
        let formats = Formats { images: Some(ImageFormat::Png), depth: Some(DepthFormat::Png16) };
        let written = json!(formats);
        let names: Vec<&String> = written.as_object().into_iter().flatten().map(|(name, _)| name).collect();
        assert_eq!(names, Formats::FIELDS);
        assert_eq!(written, json!({ "images": "png", "depth": "png16" }));
    }
}
