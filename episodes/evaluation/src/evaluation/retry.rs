//! Failed episodes that are retried from a moment shortly before their failure.

use std::path::{Path, PathBuf};

use tandem_episodes::{EpisodeSpec, Recording};
use tandem_sim::CONTROL_HZ;

use crate::reports::{LoadError, load, moment_of_failure};

/// An episode that failed, and the time of its failure.
#[derive(Clone, Debug)]
pub struct FailedEpisode {
    pub spec: EpisodeSpec,
    /// Path of its `episode.mcap`.
    pub recording: PathBuf,
    /// Simulated time of the failure.
    pub time_s: f64,
}

impl FailedEpisode {
    /// Returns the world's control step `before_s` seconds before the failure.
    pub fn step_before(&self, before_s: u32) -> u64 {
        ((self.time_s - f64::from(before_s)).max(0.0) * CONTROL_HZ).round() as u64
    }
}

/// Returns the recorded episodes in `folder` that failed, and the reasons why other failed ones cannot be
/// retried.
///
/// # Errors
///
/// If the folder cannot be loaded.
pub fn failed_episodes(folder: &Path) -> Result<(Vec<FailedEpisode>, Vec<String>), LoadError> {
    let loaded = load(&[folder.to_owned()])?;
    let (mut failed, mut left_out): (Vec<FailedEpisode>, _) = (Vec::new(), loaded.skipped);
    for found in loaded.episodes.iter().filter(|found| found.played.counts() && !found.played.succeeded()) {
        let spec = &found.played.spec;
        let name = again_name(spec);
        let mut leave_out = |why: &str| left_out.push(format!("{name}: {why}"));
        let Some(path) = &found.recording else {
            leave_out("it was not recorded; play it with --record");
            continue;
        };
        if failed.iter().any(|known| again_name(&known.spec) == name) {
            leave_out("another failure of the same task, seed and stress is begun again");
            continue;
        }
        // The retry may run in another working directory.
        let recording = std::path::absolute(path).unwrap_or_else(|_| path.clone());
        match Recording::read(&recording).and_then(|read| moment_of_failure(&read)) {
            Ok((time_s, _)) => failed.push(FailedEpisode { spec: spec.clone(), recording, time_s }),
            Err(error) => leave_out(&error.to_string()),
        }
    }
    Ok((failed, left_out))
}

/// Returns the name of a retried episode's file and folder. Failed episodes of one seed may differ in stress.
pub(super) fn again_name(spec: &EpisodeSpec) -> String {
    let stress = spec.stress.map(|stress| format!("-{stress}")).unwrap_or_default();
    format!("{}-{}{stress}-again", spec.task.id, spec.seed)
}
