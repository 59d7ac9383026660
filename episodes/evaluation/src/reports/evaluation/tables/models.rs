//! Tables of language models: requests, costs, and endings of play.

use super::super::costs::{CostSum, ValueRange};
use super::super::policy::{PolicyReport, TaskReport};
use super::super::rate::percent;
use crate::reports::table::{NONE, Table};

/// Compares policies task by task. Only tasks for which any policy has notes have rows.
pub fn agents(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "Agents",
        "Of episodes from the task's beginning. Phases are a mean; all else but success is a median an episode. Tokens, price and the \
         time of models are what notes say; of tokens that were read, which share came from a cache. The price of a success is that of \
         all episodes over those that succeeded.",
        &[
            "Policy",
            "Task",
            "Success",
            "Phases",
            "Steps",
            "Calls",
            "Thinking (s)",
            "Models (s)",
            "Tokens read (k)",
            "From a cache",
            "Tokens written (k)",
            "Price ($)",
            "A success ($)",
        ],
        2,
    );
    let any = |policy: &PolicyReport| policy.tasks.iter().any(|task| task.models.is_some());
    if policies.iter().any(any) {
        let rows = policies
            .iter()
            .flat_map(|policy| policy.tasks.iter().filter_map(move |task| agents_row(policy, task)));
        table.rows.extend(rows);
    }
    table
}

/// Returns the row of one task; `None` if no episode began at the task's beginning.
fn agents_row(policy: &PolicyReport, task: &TaskReport) -> Option<Vec<String>> {
    let effort = task.effort.as_ref()?;
    let success = task.phases.last()?.cumulative?;
    let reached: f64 = task.phases.iter().filter_map(|phase| Some(phase.cumulative?.share)).sum();
    let models = task.models.as_ref();
    let median = |range: Option<&ValueRange>, scale: f64, decimals: usize| {
        range.map_or(NONE.into(), |range| format!("{:.decimals$}", range.median_value / scale))
    };
    let of_success = models.and_then(|models| models.total_usd).filter(|_| success.successes > 0);
    Some(vec![
        policy.name.clone(),
        task.task.clone(),
        success.fraction(),
        format!("{reached:.1} of {}", task.phases.len()),
        median(Some(&effort.steps), 1.0, 0),
        median(Some(&effort.calls), 1.0, 0),
        median(Some(&effort.thought), 1.0, 1),
        median(models.and_then(|models| models.model_time.as_ref()), 1.0, 1),
        median(models.map(|models| &models.input_tokens), 1e3, 1),
        models
            .and_then(|models| models.cached_share)
            .map_or(NONE.into(), |share| format!("{} %", percent(share))),
        median(models.map(|models| &models.output_tokens), 1e3, 1),
        median(models.and_then(|models| models.usd.as_ref()), 1.0, 3),
        of_success.map_or(NONE.into(), |usd| format!("{:.3}", usd / success.successes as f64)),
    ])
}

/// Sums up the requests to models.
pub fn asked(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "All that models were asked",
        "Sums of what notes say, in thousands of tokens and US dollars: of episodes that count, of those that do not, and together.",
        &[
            "Policy",
            "Counted",
            "Read (k)",
            "Written (k)",
            "Price ($)",
            "Not counted",
            "Read (k)",
            "Written (k)",
            "Price ($)",
            "All ($)",
        ],
        1,
    );
    let usd_text = |usd: Option<f64>| usd.map_or(NONE.into(), |usd| format!("{usd:.3}"));
    let sum = |sum: &CostSum| {
        let thousands =
            [sum.input_tokens, sum.output_tokens].map(|tokens| format!("{:.1}", tokens as f64 / 1e3));
        let [read, written] = thousands;
        [sum.episodes.to_string(), read, written, usd_text(sum.usd)]
    };
    for (policy, asked) in policies.iter().filter_map(|policy| Some((policy, policy.asked.as_ref()?))) {
        let all: Vec<f64> =
            [&asked.counted, &asked.not_counted].into_iter().filter_map(|sum| sum.usd).collect();
        let all = usd_text((!all.is_empty()).then(|| all.iter().sum()));
        let sums = [&asked.counted, &asked.not_counted].into_iter().flat_map(sum);
        table.rows.push([policy.name.clone()].into_iter().chain(sums).chain([all]).collect());
    }
    table
}

/// Lists the endings of the models' play, with the numbers of episodes.
pub fn endings(policies: &[PolicyReport]) -> Table {
    let mut table = Table::new(
        "How the play of models ended",
        "Of all episodes that say so, whether they count or not; with a model for each robot, of each.",
        &["Policy", "Ending", "Episodes"],
        2,
    );
    for policy in policies {
        for (ending, episodes) in policy.asked.iter().flat_map(|asked| &asked.endings) {
            table.rows.push(vec![policy.name.clone(), ending.words().into(), episodes.to_string()]);
        }
    }
    table
}
