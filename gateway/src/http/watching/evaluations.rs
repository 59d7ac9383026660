//! Evaluations in the runs folder, which other processes play, and their progress.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, SystemTime},
};

use serde::Serialize;
use tandem_evaluation::evaluation::{PlannedEpisodes, RunState, is_being_played};
use tandem_evaluation::results::{EPISODES, PlayedEpisode};

/// Depth of the search below the runs folder.
const DEPTH: usize = 3;

/// Time without progress after which an evaluation of unknown state counts as stopped.
const STOPPED_AFTER: Duration = Duration::from_secs(600);

/// Counts from the last reading of each evaluation, with the time of its last change, by folder.
#[derive(Debug, Clone, Default)]
pub struct KnownEvaluations(Arc<Mutex<BTreeMap<PathBuf, (SystemTime, EvaluationCounts)>>>);

/// Counts of an evaluation's episodes.
#[derive(Debug, Clone, Default, Serialize)]
struct EvaluationCounts {
    policies: Vec<String>,
    tasks: Vec<String>,
    played: usize,
    /// Number of counted episodes that reached the last phase.
    succeeded: usize,
    /// Number of episodes that are not counted.
    excluded: usize,
}

/// Progress of an evaluation for its card on the page.
#[derive(Debug, Serialize)]
pub struct EvaluationEntry {
    /// The evaluation's folder, relative to the runs folder.
    folder: String,
    #[serde(flatten)]
    counts: EvaluationCounts,
    /// Number of planned episodes; left out if unknown.
    #[serde(skip_serializing_if = "Option::is_none")]
    planned: Option<usize>,
    /// Time of the latest episode, in seconds since 1970.
    last_unix_s: u64,
    /// True while episodes are being played.
    runs: bool,
}

impl KnownEvaluations {
    /// Lists the evaluations below `runs`, most recently changed first.
    pub fn list(&self, runs: &Path) -> Vec<EvaluationEntry> {
        let mut folders = Vec::new();
        collect(runs, DEPTH, &mut folders);
        let mut known = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let mut found: Vec<(SystemTime, EvaluationEntry)> = folders
            .into_iter()
            .filter_map(|folder| {
                // Every played episode adds a file to this folder.
                let changed = fs::metadata(folder.join(EPISODES)).and_then(|found| found.modified()).ok()?;
                let counts = match known.get(&folder) {
                    Some((then, counts)) if *then == changed => counts.clone(),
                    _ => EvaluationCounts::read(&folder.join(EPISODES)),
                };
                known.insert(folder.clone(), (changed, counts.clone()));
                Some((changed, entry(runs, &folder, changed, counts)?))
            })
            .collect();
        found.sort_by_key(|(changed, _)| std::cmp::Reverse(*changed));
        found.into_iter().map(|(_, entry)| entry).collect()
    }
}

fn collect(folder: &Path, depth: usize, found: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    for entry in entries.filter(|entry| entry.file_type().is_ok_and(|kind| kind.is_dir())) {
        let path = entry.path();
        if path.join(EPISODES).is_dir() {
            found.push(path);
        } else if depth > 1 {
            collect(&path, depth - 1, found);
        }
    }
}

fn entry(
    runs: &Path,
    folder: &Path,
    changed: SystemTime,
    counts: EvaluationCounts,
) -> Option<EvaluationEntry> {
    let name = folder.strip_prefix(runs).ok()?.to_str()?.replace('\\', "/");
    let planned = PlannedEpisodes::read_all(folder);
    let last_unix_s = changed.duration_since(SystemTime::UNIX_EPOCH).map_or(0, |since| since.as_secs());
    let runs = planned.is_some_and(|planned| is_played(folder, planned, counts.played, changed));
    let planned = planned.map(|planned| planned.episodes);
    Some(EvaluationEntry { folder: name, counts, planned, last_unix_s, runs })
}

/// Returns true while an evaluation is being played; `changed` is the time of its last change.
fn is_played(folder: &Path, planned: PlannedEpisodes, played: usize, changed: SystemTime) -> bool {
    match (planned.state, is_being_played(folder)) {
        (Some(RunState::Complete | RunState::Stopped), _) => false,
        // The process may have ended without recording its end.
        (_, Some(is_played)) => is_played,
        (_, None) => {
            let lately = changed.elapsed().map_or(true, |since| since < STOPPED_AFTER);
            lately && played + planned.left_out < planned.episodes
        }
    }
}

impl EvaluationCounts {
    fn read(folder: &Path) -> EvaluationCounts {
        let mut counts = EvaluationCounts::default();
        let files = fs::read_dir(folder).into_iter().flatten().flatten().map(|entry| entry.path());
        for path in files.filter(|path| path.extension().is_some_and(|extension| extension == "json")) {
            let read = fs::read(&path).ok().and_then(|bytes| serde_json::from_slice(&bytes).ok());
            if let Some(episode) = read {
                counts.count(&episode);
            }
        }
        counts
    }

    fn count(&mut self, episode: &PlayedEpisode) {
        self.played += 1;
        self.succeeded += usize::from(episode.counts() && episode.succeeded());
        self.excluded += usize::from(!episode.counts());
        for (known, name) in
            [(&mut self.policies, &episode.policy.full_name()), (&mut self.tasks, &episode.result.task)]
        {
            if !known.contains(name) {
                known.push(name.clone());
                known.sort();
            }
        }
    }
}
