//! How pictures come to programs.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// How the pictures of an observation are to come.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub struct Formats {
    /// "png", or "rgb" for the bytes of each pixel row by row, which come in `arrays` then. Null: "png".
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub images: Option<ImageFormat>,
    /// Depth along the optical axis at every pixel, in `arrays`: "float16" for little-endian numbers in metres, infinite where
    /// nothing is; "png16" for a PNG of 16 bits in millimetres, 0 where nothing is. Under the benchmark protocol only. Null: none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub depth: Option<DepthFormat>,
}

impl Formats {
    /// The fields, as JSON names them.
    pub const FIELDS: [&str; 2] = ["images", "depth"];
}

/// How colours come.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageFormat {
    /// A PNG file.
    Png,
    /// Three bytes a pixel.
    Rgb,
}

/// How depth comes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DepthFormat {
    /// Numbers of half precision, in metres.
    Float16,
    /// A PNG file, in millimetres.
    Png16,
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
