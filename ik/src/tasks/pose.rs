//! Common parts of tasks on poses: the weighting and clamping of their error, its columns and its six rows.

use nalgebra::{Isometry3, UnitQuaternion, Vector6};

use super::goal::{FrameError, Sink, TaskScratch};
use crate::model::{Configuration, FrameId};
use crate::spatial::Log6;

/// Returns |W e|^2 of a pose's error.
pub(super) fn weighted_square(error: &Vector6<f64>, [position, orientation]: [f64; 2]) -> f64 {
    (position * error.fixed_rows::<3>(0)).norm_squared()
        + (orientation * error.fixed_rows::<3>(3)).norm_squared()
}

/// Clamps a pose error to the distance and angle of the clamp. The initial direction of motion is unchanged.
pub(super) fn clamped(missing: &Isometry3<f64>, clamp: Option<FrameError>) -> Isometry3<f64> {
    let Some(clamp) = clamp else { return *missing };
    let (way, turn) = (missing.translation.vector, missing.rotation.scaled_axis());
    let part = |limit: f64, size: f64| (limit / size.max(f64::MIN_POSITIVE)).min(1.0);
    let translation = way * part(clamp.position_m, way.norm());
    let rotation = UnitQuaternion::from_scaled_axis(turn * part(clamp.orientation_rad, turn.norm()));
    Isometry3::from_parts(translation.into(), rotation)
}

/// Computes the columns of the joints that move a frame, for the logarithm of its error.
pub(super) fn read_columns(
    scratch: &mut TaskScratch,
    configuration: &Configuration,
    frame: FrameId,
    missing: &Log6,
) {
    let root_from_frame = configuration.root_from_frame(frame);
    scratch.columns.clear();
    for &joint in configuration.model().support(frame) {
        let (linear, angular) = configuration.body_jacobian_column(&root_from_frame, joint);
        scratch.columns.push((joint, missing.transform(&linear, &angular)));
    }
}

/// Writes one row per component of the error whose columns are in `scratch`.
pub(super) fn write_pose_rows(
    scratch: &mut TaskScratch,
    error: &Vector6<f64>,
    [position, orientation]: [f64; 2],
    gain: f64,
    sink: &mut dyn Sink,
) {
    for i in 0..6 {
        let weight = if i < 3 { position } else { orientation };
        scratch.entries.clear();
        scratch.entries.extend(scratch.columns.iter().map(|(joint, column)| (*joint, weight * column[i])));
        sink.row(&scratch.entries, weight * gain * error[i]);
    }
}
