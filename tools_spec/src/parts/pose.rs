//! Poses as JSON carries them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A pose in the frame that the field which holds it names.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pose {
    /// [x, y, z] in metres.
    pub position_m: [f64; 3],
    /// [w, x, y, z], norm 1.
    pub quaternion_wxyz: [f64; 4],
}
