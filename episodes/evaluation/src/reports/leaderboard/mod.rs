//! Leaderboard: one table of policies and models from many run folders and of the benchmark's published
//! figures. Unknown cells are empty.

mod published;
mod rows;
mod tables;
#[cfg(test)]
mod tests;

use std::path::Path;

use serde::Serialize;
use tandem_tools_spec::{Assistance, EndReason, PhaseTimes, Protocol};

use super::evaluation::{LoadedEpisodes, Rate, ReportOrigin, ValueRange};
use crate::statistics::Count;

/// Rows of policies and models.
#[derive(Debug, Serialize)]
pub struct Leaderboard {
    /// `None` if the leaderboard was not created by a command.
    pub made: Option<ReportOrigin>,
    /// Each policy over all its tasks, then the published methods.
    pub policies: Vec<BoardRow>,
    /// Each policy and published method on each of its tasks.
    pub tasks: Vec<BoardRow>,
    /// Episodes with a page that shows the policy's thoughts, calls and observations.
    pub transcripts: Vec<TranscriptLink>,
    /// Files that could not be read, with the reasons.
    pub skipped: Vec<String>,
}

/// One policy with one protocol, assistance level and build, on some tasks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct BoardRow {
    pub policy: String,
    /// Version and fingerprint of the build that played the episodes, or the publication of the figures.
    pub source: String,
    pub protocol: Option<Protocol>,
    /// `None` for published figures.
    pub assistance: Option<Assistance>,
    /// Other settings that differ from Tandem's defaults.
    pub settings: Vec<String>,
    pub tasks: Vec<String>,
    /// Number of episodes that count.
    pub episodes: usize,
    /// Number of episodes in which the policy itself or the simulator failed; `None` for published figures.
    pub not_counted: Option<usize>,
    /// Number of reached phases among all phases of all episodes.
    pub phases: Count,
    /// Share of the episodes that reached the last phase.
    pub success: Option<Rate>,
    pub costs: BoardCosts,
    /// Times at which the first and the last episode ended, in UTC.
    pub ended_at: Option<[String; 2]>,
}

/// Costs per episode. Each is `None` if it is unknown for all episodes.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct BoardCosts {
    pub requests: Option<ValueRange>,
    /// Size of the recorded replies' text, in 1,000 bytes.
    pub reply_kilobytes: Option<ValueRange>,
    /// The policy's thinking time in seconds.
    pub thinking: Option<ValueRange>,
    pub input_tokens: Option<ValueRange>,
    pub output_tokens: Option<ValueRange>,
    /// Price in US dollars.
    pub usd: Option<ValueRange>,
}

/// An episode with a transcript.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct TranscriptLink {
    pub policy: String,
    pub protocol: Protocol,
    pub assistance: Assistance,
    pub task: String,
    pub seed: u32,
    pub phases: PhaseTimes,
    pub ended: EndReason,
    pub requests: u32,
    pub reply_bytes: u64,
    pub thinking_s: f64,
    pub ended_at: Option<String>,
    /// Path of the page, relative to the leaderboard.
    pub link: String,
}

impl Leaderboard {
    /// Evaluates the loaded episodes, for files in `folder`.
    pub fn of(loaded: &LoadedEpisodes, folder: &Path) -> Leaderboard {
        let rows::Rows { policies, tasks, transcripts, unreadable } = rows::rows(loaded, folder);
        let published_policies = published::policies();
        let mut skipped = loaded.skipped.clone();
        skipped.extend(unreadable);
        Leaderboard {
            made: None,
            policies: policies.into_iter().chain(published_policies).collect(),
            tasks: published::beside(tasks),
            transcripts,
            skipped,
        }
    }

    /// Returns the files of the leaderboard with their names.
    ///
    /// # Errors
    ///
    /// If the leaderboard cannot be serialized to JSON.
    pub fn files(&self) -> Result<[(&'static str, String); 3], serde_json::Error> {
        Ok([
            ("leaderboard.md", tables::markdown(self)),
            ("leaderboard.html", tables::html(self)),
            ("leaderboard.json", serde_json::to_string_pretty(self)? + "\n"),
        ])
    }
}
