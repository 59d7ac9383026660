//! Rows of played episodes. Episodes with different protocols, assistance levels, settings or builds are in
//! different rows.

use std::path::Path;

use tandem_episodes::{Recording, RecordingError, TranscriptEntry, tasks};
use tandem_tools_spec::{Assistance, Protocol, Usage};

use super::{BoardCosts, BoardRow, TranscriptLink};
use crate::reports::evaluation::{FoundEpisode, LoadedEpisodes, Rate, ValueRange, ended_between};
use crate::reports::links::relative;
use crate::results::{PLAYERS, PlayedEpisode};
use crate::statistics::Count;

/// Departures that have separate columns, or follow from the task.
const OTHER_COLUMNS: [&str; 3] = ["assistance: ", "suite: ", "task file: "];

/// Rows of the loaded episodes.
pub struct Rows {
    pub policies: Vec<BoardRow>,
    pub tasks: Vec<BoardRow>,
    pub transcripts: Vec<TranscriptLink>,
    /// Recordings that could not be read, with the reasons.
    pub unreadable: Vec<String>,
}

/// Properties that all episodes of a row share.
#[derive(Clone, PartialEq)]
struct RowKey {
    policy: String,
    /// Settings of the policy that its name does not contain.
    policy_settings: Option<serde_json::Value>,
    protocol: Protocol,
    assistance: Assistance,
    settings: Vec<String>,
    /// Name of the base controller, identity of the robot's file, and hash of the scene's file.
    world: [String; 3],
    build: String,
}

/// An episode with the size of the replies that its policy received.
struct BoardEpisode<'a> {
    found: &'a FoundEpisode,
    /// `None` without a recording, or if the policy ran in the simulator's process.
    reply_bytes: Option<u64>,
}

/// Returns the rows of all whole episodes. Links are relative to a file in `folder`.
pub fn rows(loaded: &LoadedEpisodes, folder: &Path) -> Rows {
    let mut unreadable = Vec::new();
    let whole = loaded.episodes.iter().filter(|found| found.played.start_phase().is_none());
    let episodes: Vec<BoardEpisode> = whole
        .map(|found| {
            let reads_text = !PLAYERS.contains(&found.played.policy.name.as_str());
            let recording = found.recording.as_deref().filter(|_| reads_text);
            let read = recording.map_or(Ok(None), reply_bytes);
            let reply_bytes = read.unwrap_or_else(|error| {
                unreadable.push(error.to_string());
                None
            });
            BoardEpisode { found, reply_bytes }
        })
        .collect();
    let mut groups: Vec<(RowKey, Vec<&BoardEpisode>)> = Vec::new();
    for episode in &episodes {
        let key = RowKey::of(&episode.found.played);
        match groups.iter_mut().find(|(known, _)| *known == key) {
            Some((_, group)) => group.push(episode),
            None => groups.push((key, vec![episode])),
        }
    }
    let mut policies: Vec<BoardRow> = groups.iter().map(|(key, group)| key.row(group)).collect();
    sort(&mut policies);
    let mut by_task = Vec::new();
    for task in tasks::in_order(episodes.iter().map(|episode| &episode.found.played.spec.task)) {
        let of_task = groups.iter().filter_map(|(key, group)| {
            let of_task = group.iter().copied().filter(|episode| episode.found.played.spec.task == *task);
            let of_task: Vec<&BoardEpisode> = of_task.collect();
            (!of_task.is_empty()).then(|| key.row(&of_task))
        });
        let mut of_task: Vec<BoardRow> = of_task.collect();
        sort(&mut of_task);
        by_task.extend(of_task);
    }
    let transcripts = episodes.iter().filter_map(|episode| episode.transcript(folder)).collect();
    Rows { policies, tasks: by_task, transcripts, unreadable }
}

/// Sorts rows by protocol and assistance, then by success and phases in descending order.
fn sort(rows: &mut [BoardRow]) {
    let rules = |row: &BoardRow| {
        (row.protocol.map(Protocol::name), row.assistance.map(Assistance::name), row.settings.clone())
    };
    let shares = |row: &BoardRow| {
        [row.success.map_or(0.0, |success| success.share), row.phases.share().unwrap_or_default()]
    };
    rows.sort_by(|one, other| {
        let [success, phases] = [0, 1].map(|index| shares(other)[index].total_cmp(&shares(one)[index]));
        rules(one).cmp(&rules(other)).then(success).then(phases)
    });
}

/// Returns the size of the recorded replies in bytes; `None` if no reply was sent outside the simulator's
/// process.
fn reply_bytes(recording: &Path) -> Result<Option<u64>, RecordingError> {
    let recording = Recording::read(recording)?;
    let mut bytes = None;
    for entry in recording.transcript()? {
        if let TranscriptEntry::Call { call, .. } = entry
            && call.shown.is_none()
        {
            *bytes.get_or_insert(0) += call.reply.len() as u64;
        }
    }
    Ok(bytes)
}

impl RowKey {
    fn of(played: &PlayedEpisode) -> RowKey {
        let spec = &played.spec;
        let mut settings = spec.peculiarities();
        settings.retain(|what| !OTHER_COLUMNS.iter().any(|column| what.starts_with(column)));
        RowKey {
            policy: played.policy.full_name(),
            policy_settings: played.policy.settings.clone(),
            protocol: spec.protocol,
            assistance: spec.assistance,
            settings,
            world: [
                played.locomotion.clone(),
                spec.robot.identity(),
                spec.scene.as_ref().map(|scene| scene.xxh3.clone()).unwrap_or_default(),
            ],
            build: played.build.clone(),
        }
    }

    /// Returns the row of these episodes, which share this key.
    fn row(&self, episodes: &[&BoardEpisode]) -> BoardRow {
        let (counted, excluded): (Vec<&BoardEpisode>, Vec<&BoardEpisode>) =
            episodes.iter().partition(|episode| episode.found.played.counts());
        let of = |episode: &BoardEpisode| {
            let spec = &episode.found.played.spec;
            (spec.task.id.clone(), spec.seed)
        };
        let played_again = |one: &&&BoardEpisode| counted.iter().any(|other| of(other) == of(one));
        let not_counted = excluded.iter().filter(|one| !played_again(one)).count();
        let played: Vec<&PlayedEpisode> = counted.iter().map(|episode| &episode.found.played).collect();
        let order = tasks::in_order(episodes.iter().map(|episode| &episode.found.played.spec.task));
        BoardRow {
            policy: self.policy.clone(),
            source: self.build.clone(),
            protocol: Some(self.protocol),
            assistance: Some(self.assistance),
            settings: self.settings.clone(),
            tasks: order.into_iter().map(|task| task.id.clone()).collect(),
            episodes: played.len(),
            not_counted: Some(not_counted),
            phases: phases(&played),
            success: Rate::of(Count {
                successes: played.iter().filter(|played| played.succeeded()).count(),
                trials: played.len(),
            }),
            costs: costs(&counted),
            ended_at: ended_between(&played),
        }
    }
}

fn phases(played: &[&PlayedEpisode]) -> Count {
    let phases = |one: &&PlayedEpisode| one.spec.task.phases.len();
    let reached = |one: &&PlayedEpisode| (0..phases(one)).filter(|phase| one.reached(*phase)).count();
    Count { successes: played.iter().map(reached).sum(), trials: played.iter().map(phases).sum() }
}

fn costs(episodes: &[&BoardEpisode]) -> BoardCosts {
    let range = |of: &dyn Fn(&BoardEpisode) -> Option<f64>| {
        ValueRange::of(episodes.iter().filter_map(|episode| of(episode)).collect())
    };
    let usage = |of: fn(&Usage) -> Option<f64>| {
        range(&|episode| episode.found.played.result.usage.as_ref().and_then(of))
    };
    BoardCosts {
        requests: range(&|episode| Some(f64::from(episode.found.played.requests()))),
        reply_kilobytes: range(&|episode| Some(episode.reply_bytes? as f64 / 1e3)),
        thinking: range(&|episode| Some(episode.found.played.thought_s)),
        input_tokens: usage(|usage| Some(usage.input_tokens as f64)),
        output_tokens: usage(|usage| Some(usage.output_tokens as f64)),
        usd: usage(|usage| usage.usd),
    }
}

impl BoardEpisode<'_> {
    /// Returns the link to the page of the episode. Returns `None` if there is no page, or if the policy
    /// wrote no notes.
    fn transcript(&self, folder: &Path) -> Option<TranscriptLink> {
        let played = &self.found.played;
        Some(TranscriptLink {
            policy: played.policy.full_name(),
            protocol: played.spec.protocol,
            assistance: played.spec.assistance,
            task: played.spec.task.id.clone(),
            seed: played.spec.seed,
            phases: played.result.phases.clone(),
            ended: played.result.ended,
            requests: played.requests(),
            reply_bytes: self.reply_bytes?,
            thinking_s: played.thought_s,
            ended_at: played.ended_at.clone(),
            link: relative(folder, self.found.page.as_deref()?)?,
        })
    }
}
