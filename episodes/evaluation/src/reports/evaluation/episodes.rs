//! One row for each episode, whether it counts or not, for further computation.

use std::collections::BTreeMap;

use serde::Serialize;
use tandem_episodes::{Phase, Start};
use tandem_tools_spec::{Assistance, EndReason, Protocol};

use super::csv::quoted;
use super::load::LoadedEpisodes;
use super::policy::groups;
use crate::results::PlayedEpisode;

/// One episode.
#[derive(Debug, Serialize)]
pub struct EpisodeRow {
    pub policy: String,
    pub task: String,
    pub seed: u32,
    pub protocol: Protocol,
    pub assistance: Assistance,
    /// Number of the phase at which it began; `task` for the task's beginning, `moment` for another moment.
    pub start: String,
    /// False if it is in no rate, because the policy itself or the simulator failed.
    pub counted: bool,
    pub success: bool,
    /// Simulated times at which phases were reached, by their numbers.
    pub phases_s: BTreeMap<String, Option<f64>>,
    pub ended: EndReason,
    pub steps: u32,
    pub requests: u32,
    pub thinking_s: f64,
    pub falls: u32,
    /// Tokens of models, their price in US dollars and their time; `None` if no note has them.
    pub input_tokens: Option<u64>,
    pub output_tokens: Option<u64>,
    pub usd: Option<f64>,
    pub model_s: Option<f64>,
    /// Number of earlier attempts, which do not count.
    pub earlier_attempts: usize,
    pub controller: String,
    pub build: String,
    pub state_hash: Option<String>,
    pub ended_at: Option<String>,
    pub note: Option<String>,
}

/// Returns the rows of all episodes, by policy.
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

    /// Returns the names and texts of the cells, with a column for each of `phases` phases.
    fn cells(&self, phases: usize) -> Vec<(String, String)> {
        let time_s = |phase: usize| {
            let number = Phase::number(phase);
            let time_s = self.phases_s.get(&number).copied().flatten();
            (format!("{number}_s"), text(time_s))
        };
        let named = |(name, text): (&str, String)| (name.to_owned(), text);
        let before = [
            ("policy", self.policy.clone()),
            ("task", self.task.clone()),
            ("seed", self.seed.to_string()),
            ("protocol", self.protocol.name().into()),
            ("assistance", self.assistance.name().into()),
            ("start", self.start.clone()),
            ("counted", self.counted.to_string()),
            ("success", self.success.to_string()),
        ];
        let after = [
            ("ended", word(&self.ended)),
            ("steps", self.steps.to_string()),
            ("requests", self.requests.to_string()),
            ("thinking_s", self.thinking_s.to_string()),
            ("falls", self.falls.to_string()),
            ("input_tokens", text(self.input_tokens)),
            ("output_tokens", text(self.output_tokens)),
            ("usd", text(self.usd)),
            ("model_s", text(self.model_s)),
            ("earlier_attempts", self.earlier_attempts.to_string()),
            ("controller", self.controller.clone()),
            ("build", self.build.clone()),
            ("state_hash", text(self.state_hash.as_ref())),
            ("ended_at", text(self.ended_at.as_ref())),
            ("note", text(self.note.as_ref())),
        ];
        before.map(named).into_iter().chain((0..phases).map(time_s)).chain(after.map(named)).collect()
    }
}

/// Returns the name of a value in JSON.
fn word(value: &impl Serialize) -> String {
    let value = serde_json::to_value(value).unwrap_or_default();
    value.as_str().unwrap_or_default().to_owned()
}

fn text<T: ToString>(value: Option<T>) -> String {
    value.map_or(String::new(), |value| value.to_string())
}

/// Returns a line for each episode; cells without a value are empty.
pub fn csv(rows: &[EpisodeRow]) -> String {
    let phases = rows.iter().map(|row| row.phases_s.len()).max().unwrap_or_default();
    let cells: Vec<Vec<(String, String)>> = rows.iter().map(|row| row.cells(phases)).collect();
    let line = |cells: Vec<String>| cells.join(",") + "\n";
    let head = cells.first().map(|row| line(row.iter().map(|(name, _)| name.clone()).collect()));
    let lines = cells.iter().map(|row| line(row.iter().map(|(_, text)| quoted(text)).collect()));
    head.into_iter().chain(lines).collect()
}
