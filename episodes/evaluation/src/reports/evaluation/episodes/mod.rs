//! Rows of single episodes, whether they count or not, for further analysis.

mod parquet;

use std::collections::BTreeMap;

use serde::Serialize;
use tandem_episodes::{Phase, Start};
use tandem_tools_spec::{Assistance, EndReason, Protocol};

use super::csv::quoted;
use super::load::LoadedEpisodes;
use super::policy::groups;
use crate::results::PlayedEpisode;

/// One episode.
#[derive(Clone, Debug, Serialize)]
pub struct EpisodeRow {
    pub policy: String,
    pub task: String,
    pub seed: u32,
    pub protocol: Protocol,
    pub assistance: Assistance,
    /// Number of the phase at which the episode began; `task` for the task's beginning, `moment` for any
    /// other moment.
    pub start: String,
    /// False if the episode is in no rate because the policy itself or the simulator failed.
    pub counted: bool,
    pub success: bool,
    /// Simulated time at which each phase was reached, by phase number.
    pub phases_s: BTreeMap<String, Option<f64>>,
    pub ended: EndReason,
    pub steps: u32,
    pub requests: u32,
    pub thinking_s: f64,
    pub falls: u32,
    /// Tokens of models, their price in US dollars and their response time; `None` if no note reports them.
    pub input_tokens: Option<u64>,
    pub output_tokens: Option<u64>,
    pub usd: Option<f64>,
    pub model_s: Option<f64>,
    /// Number of earlier attempts that do not count.
    pub earlier_attempts: usize,
    pub controller: String,
    pub build: String,
    pub state_hash: Option<String>,
    pub ended_at: Option<String>,
    pub note: Option<String>,
}

/// Returns the rows of all episodes, grouped by policy.
pub fn rows(loaded: &LoadedEpisodes) -> Vec<EpisodeRow> {
    let groups = groups(loaded.episodes.iter());
    let rows = groups.iter().flat_map(|group| group.all().map(|played| EpisodeRow::of(&group.name, played)));
    rows.collect()
}

impl EpisodeRow {
    fn of(policy: &str, played: &PlayedEpisode) -> EpisodeRow {
        let PlayedEpisode { spec, result, .. } = played;
        let usage = result.usage.as_ref();
        EpisodeRow {
            policy: policy.into(),
            task: spec.task.id.clone(),
            seed: spec.seed,
            protocol: spec.protocol,
            assistance: spec.assistance,
            start: match &spec.start {
                Start::Task => "task".into(),
                Start::Phase(start) => start.phase.clone(),
                Start::Checkpoint(_) | Start::Moment(_) => "moment".into(),
            },
            counted: played.counts(),
            success: played.succeeded(),
            phases_s: result.phases.0.iter().cloned().collect(),
            ended: result.ended,
            steps: result.env_steps,
            requests: played.requests(),
            thinking_s: played.thought_s,
            falls: result.falls,
            input_tokens: usage.map(|usage| usage.input_tokens),
            output_tokens: usage.map(|usage| usage.output_tokens),
            usd: usage.and_then(|usage| usage.usd),
            model_s: usage.and_then(|usage| usage.model_s),
            earlier_attempts: played.attempts.len(),
            controller: played.locomotion.clone(),
            build: played.build.clone(),
            state_hash: result.state_hash.clone(),
            ended_at: played.ended_at.clone(),
            note: played.note.clone(),
        }
    }

    /// Returns the names of the columns with their cells. The row has columns for `phases` phases.
    fn cells(self, phases: usize) -> Vec<(String, Cell)> {
        let time_s = |phase: usize| {
            let number = Phase::number(phase);
            let time_s = self.phases_s.get(&number).copied().flatten();
            (format!("{number}_s"), Cell::Number(time_s))
        };
        let times_s: Vec<_> = (0..phases).map(time_s).collect();
        let before = [
            ("policy", Cell::Text(Some(self.policy))),
            ("task", Cell::Text(Some(self.task))),
            ("seed", Cell::Count(Some(self.seed.into()))),
            ("protocol", Cell::Text(Some(self.protocol.name().into()))),
            ("assistance", Cell::Text(Some(self.assistance.name().into()))),
            ("start", Cell::Text(Some(self.start))),
            ("counted", Cell::Flag(self.counted)),
            ("success", Cell::Flag(self.success)),
        ];
        let after = [
            ("ended", Cell::Text(Some(word(&self.ended)))),
            ("steps", Cell::Count(Some(self.steps.into()))),
            ("requests", Cell::Count(Some(self.requests.into()))),
            ("thinking_s", Cell::Number(Some(self.thinking_s))),
            ("falls", Cell::Count(Some(self.falls.into()))),
            ("input_tokens", Cell::Count(self.input_tokens)),
            ("output_tokens", Cell::Count(self.output_tokens)),
            ("usd", Cell::Number(self.usd)),
            ("model_s", Cell::Number(self.model_s)),
            ("earlier_attempts", Cell::Count(Some(self.earlier_attempts as u64))),
            ("controller", Cell::Text(Some(self.controller))),
            ("build", Cell::Text(Some(self.build))),
            ("state_hash", Cell::Text(self.state_hash)),
            ("ended_at", Cell::Text(self.ended_at)),
            ("note", Cell::Text(self.note)),
        ];
        let named = |(name, cell): (&str, Cell)| (name.to_owned(), cell);
        before.map(named).into_iter().chain(times_s).chain(after.map(named)).collect()
    }
}

/// Returns the JSON name of a value, for example of an enum variant.
fn word(value: &impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

/// Value of a cell.
enum Cell {
    Text(Option<String>),
    Flag(bool),
    Count(Option<u64>),
    Number(Option<f64>),
}

impl Cell {
    /// Returns the value in CSV.
    fn text(&self) -> String {
        match self {
            Cell::Text(text) => quoted(text.as_deref().unwrap_or_default()),
            Cell::Flag(flag) => flag.to_string(),
            Cell::Count(count) => count.map_or(String::new(), |count| count.to_string()),
            Cell::Number(number) => number.map_or(String::new(), |number| number.to_string()),
        }
    }
}

fn all_cells(rows: &[EpisodeRow]) -> Vec<Vec<(String, Cell)>> {
    let phases = rows.iter().map(|row| row.phases_s.len()).max().unwrap_or_default();
    rows.iter().map(|row| row.clone().cells(phases)).collect()
}

/// Returns a line for each episode; cells without a value are empty.
pub fn csv(rows: &[EpisodeRow]) -> String {
    let cells = all_cells(rows);
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let head = cells.first().map(|row| line(row.iter().map(|(name, _)| name.clone()).collect()));
    let lines = cells.iter().map(|row| line(row.iter().map(|(_, cell)| cell.text()).collect()));
    head.into_iter().chain(lines).collect()
}

/// Returns the same table as a Parquet file; cells without a value are null.
pub fn parquet(rows: &[EpisodeRow]) -> Vec<u8> {
    let mut columns: Vec<(String, Vec<Cell>)> = Vec::new();
    for row in all_cells(rows) {
        columns.resize_with(row.len(), Default::default);
        for (column, (name, cell)) in columns.iter_mut().zip(row) {
            column.0 = name;
            column.1.push(cell);
        }
    }
    parquet::file(&columns, rows.len())
}
