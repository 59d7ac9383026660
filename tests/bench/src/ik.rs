//! Inverse kinematics of both wrists, with the upper body that episodes use.

use std::path::Path;

use tandem_episodes::upper_body;
use tandem_ik::Model;
use tandem_ik::bench::{Report as IkReport, TargetSet, run};
use tandem_sim::assets;

use crate::error::BenchError;

/// Number of targets drawn if no file is given.
const SAMPLED_TARGETS: usize = 200;
const SAMPLE_SEED: u64 = 1;
const WRISTS: [&str; 2] = ["left_wrist_yaw_link", "right_wrist_yaw_link"];

/// Solves the targets of a file, or 200 targets drawn from the robot's joint ranges.
///
/// # Errors
///
/// Returns an error if the targets cannot be read, or the model cannot be used.
pub fn ik(targets: Option<&Path>) -> Result<IkReport, BenchError> {
    let whole = Model::from_mjcf(assets::robot(assets::DEFAULT_ROBOT)?)?;
    let set = match targets {
        Some(path) => {
            let read = std::fs::read_to_string(path);
            TargetSet::from_json(&read.map_err(|source| BenchError::Read { path: path.into(), source })?)?
        }
        None => {
            let upper_body = upper_body(&whole)?;
            let start_rad = vec![0.0; upper_body.nv()];
            TargetSet::sample(&upper_body, &WRISTS, &start_rad, SAMPLED_TARGETS, SAMPLE_SEED)?
        }
    };
    Ok(run(&whole, &set)?)
}
