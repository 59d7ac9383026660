//! Rows of the benchmark's published figures, from another simulator. They contain facts only: cells for
//! which the publication has no value are empty.

use tandem_tools_spec::Protocol;

use super::{BoardCosts, BoardRow};
use crate::reports::evaluation::{PUBLISHED_IN, PublishedRates, Rate, published_rows};
use crate::statistics::Count;

/// Number of episodes per task for the benchmark's language models, which use the benchmark's protocol for
/// agents.
const EPISODES_OF_AGENTS: usize = 10;

/// Returns a row for each published method over all its tasks.
pub fn policies() -> Vec<BoardRow> {
    let rows = published_rows();
    rows.chunk_by(|one, other| one.method == other.method).map(row).collect()
}

/// Returns the rows by task. Each task's rows are followed by the published rows of the task.
pub fn beside(played: Vec<BoardRow>) -> Vec<BoardRow> {
    let published = published_rows();
    let mut rows = Vec::new();
    for of_task in played.chunk_by(|one, other| one.tasks == other.tasks) {
        rows.extend_from_slice(of_task);
        let same = |row: &&PublishedRates| of_task.iter().any(|played| played.tasks == [row.task.as_str()]);
        rows.extend(published.iter().filter(same).map(|published| row(std::slice::from_ref(published))));
    }
    rows
}

/// Returns the row of one method on these tasks.
fn row(rates: &[PublishedRates]) -> BoardRow {
    let count = |share: f64, of: &PublishedRates| (share * of.episodes as f64).round() as usize;
    let episodes = rates.iter().map(|of| of.episodes).sum();
    let last = rates.iter().filter_map(|of| Some(count(*of.phases_share.last()?, of)));
    let reached = rates.iter().flat_map(|of| of.phases_share.iter().map(|share| count(*share, of)));
    let is_agent = rates.iter().all(|of| of.episodes == EPISODES_OF_AGENTS);
    BoardRow {
        policy: rates.first().map(|of| of.method.clone()).unwrap_or_default(),
        source: PUBLISHED_IN.into(),
        protocol: Some(if is_agent { Protocol::Agentic } else { Protocol::Benchmark }),
        assistance: None,
        settings: Vec::new(),
        tasks: rates.iter().map(|of| of.task.clone()).collect(),
        episodes,
        not_counted: None,
        phases: Count {
            successes: reached.sum(),
            trials: rates.iter().map(|of| of.episodes * of.phases_share.len()).sum(),
        },
        success: Rate::of(Count { successes: last.sum(), trials: episodes }),
        costs: BoardCosts::default(),
        ended_at: None,
    }
}
