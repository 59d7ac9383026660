//! Pixels named all at once.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::limits;

/// Every so many pixels of a rectangle, beginning at `from`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PixelRegion {
    /// Its top left pixel [u, v], as [100, 80].
    #[schemars(extend("prefixItems" = limits::pixel_range()))]
    pub from: [i64; 2],
    /// Its bottom right pixel [u, v], as [220, 170].
    #[schemars(extend("prefixItems" = limits::pixel_range()))]
    pub to: [i64; 2],
    /// 1 for every pixel, 10 for every tenth one across and down.
    #[schemars(range(min = 1, max = u32::MAX))]
    pub stride: u32,
}

impl PixelRegion {
    /// How many pixels it names with another stride, which is not zero.
    pub(crate) fn count(&self, stride: u32) -> u128 {
        let along = |axis: usize| u128::from(self.from[axis].abs_diff(self.to[axis]) / u64::from(stride)) + 1;
        along(0).saturating_mul(along(1))
    }

    /// The pixels that it names, row by row. Count them first.
    pub(crate) fn pixels(&self) -> Vec<[i64; 2]> {
        let along = |axis: usize| {
            let ends = [self.from[axis].min(self.to[axis]), self.from[axis].max(self.to[axis])];
            (ends[0]..=ends[1]).step_by(self.stride.max(1) as usize)
        };
        along(1).flat_map(|v| along(0).map(move |u| [u, v])).collect()
    }
}
