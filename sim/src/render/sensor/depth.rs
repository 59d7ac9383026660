//! Depth images of a D435i's stereo cameras: noisy, quantised disparity, and holes.
//!
//! The two imagers have global shutters. Depth is aligned to the pixels of the colour image. The left imager
//! is the reference: a pixel has no depth if the right imager does not see the same point.

use super::lens::LensMap;
use super::noise::PixelNoise;

/// Distance between the imagers.
pub const BASELINE_M: f32 = 0.05;
/// Focal length of the imagers at their full resolution, 1280x720, from a factory calibration.
const FOCAL_PX: f32 = 645.0;
/// Disparity times depth.
pub const DISPARITY_PX_M: f32 = FOCAL_PX * BASELINE_M;
/// Disparity steps per pixel.
pub const STEPS: f32 = 32.0;
/// Standard deviation of the disparity. The assumed value keeps the depth error within the datasheet's 2 % at
/// 2 m.
pub const NOISE_PX: f32 = 0.08;
/// Range of measurable depth: the datasheet's minimum at full resolution, and its maximum.
pub const RANGE_M: [f32; 2] = [0.28, 10.0];
/// Depth units per metre: depth is reported in millimetres.
const UNITS_1_M: f32 = 1000.0;

/// Returns the depth that the camera measures; infinite where it measures none.
pub fn taken(ideal_m: &[f32], map: &LensMap, seed: u64) -> Vec<f32> {
    let noise = PixelNoise::new(seed, 1);
    let width = map.lens.width as usize;
    let mut depth_m = map.nearest_of(ideal_m);
    for (row, depth_m) in depth_m.chunks_exact_mut(width).enumerate() {
        hide(depth_m, map.lens.focal_px);
        for (column, depth_m) in depth_m.iter_mut().enumerate() {
            *depth_m = measured_m(*depth_m, noise.one(row * width + column));
        }
    }
    depth_m
}

/// Removes the depth of points that the right imager does not see. In its image, a point is shifted to the
/// left by its disparity, so nearer surfaces cover the points to their left.
fn hide(depth_m: &mut [f32], focal_px: f32) {
    let mut covered_from = f32::INFINITY;
    for (column, depth_m) in depth_m.iter_mut().enumerate().rev() {
        let seen_at = column as f32 - focal_px * BASELINE_M / *depth_m;
        if seen_at > covered_from {
            *depth_m = f32::INFINITY;
        } else {
            covered_from = seen_at;
        }
    }
}

/// Returns the measurement of a depth; `drawn_deviation` is its error in standard deviations.
#[inline(always)]
fn measured_m(ideal_m: f32, drawn_deviation: f32) -> f32 {
    let disparity_px = nearest_whole((DISPARITY_PX_M / ideal_m + NOISE_PX * drawn_deviation) * STEPS) / STEPS;
    let depth_m = nearest_whole(DISPARITY_PX_M / disparity_px * UNITS_1_M) / UNITS_1_M;
    // A disparity of zero, to which negative ones are rounded, gives a depth far beyond the range.
    if (RANGE_M[0]..=RANGE_M[1]).contains(&depth_m) && ideal_m.is_finite() { depth_m } else { f32::INFINITY }
}

/// Returns the nearest whole number; 0 for negative ones. `f32::round` calls a function on most processors.
#[inline(always)]
fn nearest_whole(value: f32) -> f32 {
    (value + 0.5) as u32 as f32
}
