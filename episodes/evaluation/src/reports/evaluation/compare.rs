//! Comparison of two policies on the same tasks and seeds.

use std::collections::BTreeMap;

use serde::Serialize;
use tandem_episodes::{Phase, tasks};

use super::policy::PolicyGroup;
use crate::results::PlayedEpisode;
use crate::statistics::{Pairs, mcnemar, newcombe};

/// Comparison of the second policy with the first.
#[derive(Debug, Serialize)]
pub struct Comparison {
    pub first: String,
    pub second: String,
    /// The rows of each task, then the rows of all tasks together.
    pub rows: Vec<PairedRow>,
}

/// One phase of one task, or of all tasks together.
#[derive(Debug, Serialize)]
pub struct PairedRow {
    /// `None` for all tasks together.
    pub task: Option<String>,
    /// The phase's number, for example `p2`.
    pub phase: String,
    /// True if it is the task's last phase.
    pub last: bool,
    pub pairs: Pairs,
    /// Success rate of the second policy minus that of the first.
    pub difference_share: f64,
    /// Newcombe's 95 % interval of the difference.
    pub interval_share: [f64; 2],
    /// McNemar's exact test, two-sided.
    pub mcnemar_p_value: f64,
}

/// Episodes by task, hash of the task file, seed and start phase; the first one if there are several.
type Episodes<'a> = BTreeMap<(&'a str, Option<&'a str>, u32, Option<usize>), &'a PlayedEpisode>;

impl Comparison {
    pub fn of(first: &PolicyGroup, second: &PolicyGroup) -> Comparison {
        let (ones, others) = (episodes(first), episodes(second));
        let shared: Vec<(&PlayedEpisode, &PlayedEpisode)> =
            ones.iter().filter_map(|(key, one)| Some((*one, *others.get(key)?))).collect();
        let order = tasks::in_order(shared.iter().map(|(one, _)| &one.spec.task));
        let most = order.iter().map(|task| task.phases.len()).max().unwrap_or_default();
        let mut rows = Vec::new();
        for task in order {
            let of_task = shared.iter().filter(|(one, _)| one.spec.task == *task).copied();
            let of_task: Vec<_> = of_task.collect();
            let last = task.phases.len() - 1;
            rows.extend((0..=last).filter_map(|phase| row(Some(&task.id), phase, phase == last, &of_task)));
        }
        let everything = (0..most).filter_map(|phase| row(None, phase, phase + 1 == most, &shared));
        rows.extend(everything);
        Comparison { first: first.name.clone(), second: second.name.clone(), rows }
    }
}

fn episodes<'a>(group: &'a PolicyGroup) -> Episodes<'a> {
    let mut found = Episodes::new();
    for played in group.episodes.iter().map(|found| &found.played) {
        let task = &played.spec.task;
        let key = (task.id.as_str(), task.file_xxh3(), played.spec.seed, played.start_phase());
        found.entry(key).or_insert(played);
    }
    found
}

/// Returns the row of a phase; `None` if the policies have no such episode in common. An episode that began
/// at a phase counts only for that phase.
fn row(
    task: Option<&str>,
    phase: usize,
    last: bool,
    shared: &[(&PlayedEpisode, &PlayedEpisode)],
) -> Option<PairedRow> {
    let mut pairs = Pairs::default();
    let counts = |played: &PlayedEpisode| played.start_phase().is_none_or(|only| only == phase);
    for (one, other) in shared.iter().filter(|(one, _)| counts(one)) {
        match (one.reached(phase), other.reached(phase)) {
            (true, true) => pairs.both += 1,
            (true, false) => pairs.first_only += 1,
            (false, true) => pairs.second_only += 1,
            (false, false) => pairs.neither += 1,
        }
    }
    Some(PairedRow {
        task: task.map(str::to_owned),
        phase: Phase::number(phase),
        last,
        difference_share: pairs.difference_share()?,
        interval_share: newcombe(pairs)?,
        mcnemar_p_value: mcnemar(pairs),
        pairs,
    })
}
