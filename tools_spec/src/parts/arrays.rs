//! Pictures as programs take them: raw, and with depth.

use base64::{Engine, prelude::BASE64_STANDARD};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize, de::Error as _};

/// Bytes: base64 in JSON, bytes as they are in MessagePack.
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

/// What one camera saw, pixel by pixel, row by row from the top left. Its size is that of its calibration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CameraArrays {
    /// The robot whose head camera it is.
    pub robot: String,
    /// Three bytes a pixel, red, green, blue, where `images` was "rgb". Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rgb: Option<Bytes>,
    /// Distances along the optical axis in metres, little-endian numbers of half precision, infinite where nothing is; where
    /// `depth` was "float16". Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_float16: Option<Bytes>,
    /// The same in millimetres as a PNG of 16 bits, 0 where nothing is or it is further than 65.535 m; where `depth` was "png16".
    /// Base64 in JSON.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth_png16: Option<Bytes>,
}
