//! Serialisation of one number per joint: serde supports arrays only up to length 32.

use serde::de::Error;
use serde::{Deserialize, Deserializer, Serialize, Serializer};

use super::JOINTS;

pub fn serialize<S: Serializer>(values: &[f32; JOINTS], serializer: S) -> Result<S::Ok, S::Error> {
    values.as_slice().serialize(serializer)
}

pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<[f32; JOINTS], D::Error> {
    let values = Vec::<f32>::deserialize(deserializer)?;
    let count = values.len();
    values.try_into().map_err(|_| Error::invalid_length(count, &"43 numbers, one per joint"))
}
