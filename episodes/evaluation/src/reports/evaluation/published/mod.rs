//! Published figures for the benchmark's tasks, from another simulator with other robot controllers. They are
//! for orientation, not for comparison. They are facts and figures only.

use serde::Serialize;

/// Name of the publication.
pub const PUBLISHED_IN: &str = "CoHuB's paper";

const PHASES: &str = include_str!("phases.csv");
const PHASE_LEVEL: &str = include_str!("phase_level.csv");

/// Rates of one method on one task.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PublishedRates {
    pub method: String,
    pub task: String,
    pub episodes: usize,
    /// Cumulative rates, by phase.
    pub phases_share: Vec<f64>,
}

/// Mean rates of one method over the phases at which episodes began.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PublishedAverages {
    pub method: String,
    pub non_collaborative_share: f64,
    pub collaborative_share: f64,
}

/// Returns the published rates by method, then by task.
pub fn rows() -> Vec<PublishedRates> {
    let row = |line: &str| {
        let mut cells = line.split(',');
        let (method, task) = (cells.next()?.into(), cells.next()?.into());
        let episodes = cells.next()?.parse().ok()?;
        Some(PublishedRates { method, task, episodes, phases_share: shares(cells)? })
    };
    PHASES.lines().skip(1).filter_map(row).collect()
}

/// Returns the published averages by method.
pub fn averages() -> Vec<PublishedAverages> {
    let row = |line: &str| {
        let (method, rest) = line.split_once(',')?;
        let [non_collaborative_share, collaborative_share] = shares(rest.split(','))?.try_into().ok()?;
        Some(PublishedAverages { method: method.into(), non_collaborative_share, collaborative_share })
    };
    PHASE_LEVEL.lines().skip(1).filter_map(row).collect()
}

/// Converts cells with percentages to shares.
fn shares<'a>(cells: impl Iterator<Item = &'a str>) -> Option<Vec<f64>> {
    cells.map(|cell| cell.parse::<f64>().ok().map(|percent| percent / 100.0)).collect()
}
