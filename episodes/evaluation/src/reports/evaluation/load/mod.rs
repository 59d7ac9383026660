//! Loading of episodes from folders: single results of `evaluate` and `collect`, and recordings of `serve`.

mod agent_file;

use std::io;
use std::path::{Path, PathBuf};

use serde::Serialize;
use tandem_episodes::{
    Recorder, Recording,
    pages::{PAGE_FILE, STRIP_FILE},
};

use crate::results::{EPISODES, PlayedEpisode, PolicyCard, ProcessRecord, STRESS, episode_note, utc_text};

/// One episode, with its files.
#[derive(Clone, Debug)]
pub struct FoundEpisode {
    pub played: PlayedEpisode,
    /// Path of its image strip; `None` if it was not recorded.
    pub strip: Option<PathBuf>,
    /// Path of its recording; `None` if there is none.
    pub recording: Option<PathBuf>,
    /// Path of its page; `None` if there is none.
    pub page: Option<PathBuf>,
    /// Folder of the episode, relative to the runs folder. The runs folder is assumed to be the parent of the
    /// reported folder, or the reported folder itself.
    pub run: String,
}

impl FoundEpisode {
    /// Creates an episode with the files in its run folder.
    fn new(played: PlayedEpisode, folder: &Path, runs: &Path) -> FoundEpisode {
        let file = |name: &str| Some(folder.join(name)).filter(|path| path.exists());
        let absolute = folder.canonicalize().unwrap_or_else(|_| folder.into());
        let run = absolute.strip_prefix(runs).unwrap_or(&absolute).to_string_lossy().replace('\\', "/");
        let (strip, recording, page) = (file(STRIP_FILE), file(Recorder::FILE_NAME), file(PAGE_FILE));
        FoundEpisode { played, strip, recording, page, run }
    }
}

/// Content of the loaded folders.
#[derive(Clone, Debug, Default)]
pub struct LoadedEpisodes {
    pub episodes: Vec<FoundEpisode>,
    /// Processes that have played in the folders.
    pub processes: Vec<FolderProcess>,
    /// Files that contain no episode, with the reasons.
    pub skipped: Vec<String>,
}

/// A process that has played in a folder.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FolderProcess {
    /// Path of the folder.
    pub folder: String,
    #[serde(flatten)]
    pub process: ProcessRecord,
}

/// Reason why there is nothing to report on.
#[derive(Debug, thiserror::Error)]
pub enum LoadError {
    #[error("cannot read {}: {source}", path.display())]
    Read { path: PathBuf, source: io::Error },
    #[error("no episodes in {}; give folders that `evaluate`, `collect` or `serve` wrote", .0.display())]
    Nothing(PathBuf),
}

/// Loads every episode of every folder once.
///
/// # Errors
///
/// If a folder cannot be read or has no episodes.
pub fn load(folders: &[PathBuf]) -> Result<LoadedEpisodes, LoadError> {
    let mut loaded = LoadedEpisodes::default();
    for folder in folders {
        let before = loaded.episodes.len() + loaded.skipped.len();
        let kept = folder.join(EPISODES);
        if kept.is_dir() {
            load_results(&kept, folder, &mut loaded)?;
            loaded.add_processes(folder);
        }
        let stressed = folder.join(STRESS);
        if stressed.is_dir() {
            // Output of `evaluate --stress` in the folder of the plain run: one folder for each axis and
            // level.
            for plan in entries(&stressed)?.into_iter().filter(|plan| plan.join(EPISODES).is_dir()) {
                load_results(&plan.join(EPISODES), folder, &mut loaded)?;
                loaded.add_processes(&plan);
            }
        } else if !kept.is_dir() {
            load_recordings(folder, &mut loaded)?;
        }
        if loaded.episodes.len() + loaded.skipped.len() == before {
            return Err(LoadError::Nothing(folder.clone()));
        }
    }
    Ok(loaded)
}

impl LoadedEpisodes {
    /// Adds an episode unless it is already there: folders may overlap.
    fn add(&mut self, found: FoundEpisode) {
        if !self.episodes.iter().any(|known| known.played == found.played) {
            self.episodes.push(found);
        }
    }

    /// Adds the processes that have played in a run's folder.
    fn add_processes(&mut self, run: &Path) {
        let folder = run.display().to_string();
        let processes = ProcessRecord::read_all(run).into_iter();
        self.processes.extend(processes.map(|process| FolderProcess { folder: folder.clone(), process }));
    }
}

/// Loads the results of single episodes, one file each. `evaluation` is the folder of their evaluation.
fn load_results(folder: &Path, evaluation: &Path, loaded: &mut LoadedEpisodes) -> Result<(), LoadError> {
    let absolute = evaluation.canonicalize().unwrap_or_else(|_| evaluation.into());
    let runs = absolute.parent().unwrap_or(&absolute);
    for path in entries(folder)?.into_iter().filter(|path| path.extension().is_some_and(|e| e == "json")) {
        let read = std::fs::read(&path).map_err(|error| error.to_string());
        match read.and_then(|bytes| serde_json::from_slice(&bytes).map_err(|error| error.to_string())) {
            Ok(played) => loaded.add(FoundEpisode::new(played, &path.with_extension(""), runs)),
            Err(reason) => loaded.skipped.push(format!("{}: {reason}", path.display())),
        }
    }
    Ok(())
}

/// Loads the recordings of a server, one folder each. The policy is that of `tandem agent` if it has played;
/// otherwise it has the name of the folder that contains the recordings.
fn load_recordings(folder: &Path, loaded: &mut LoadedEpisodes) -> Result<(), LoadError> {
    let absolute = folder.canonicalize().unwrap_or_else(|_| folder.into());
    let policy = absolute.file_name().map_or("policy".into(), |name| name.to_string_lossy().into_owned());
    let is_run = folder.join(Recorder::FILE_NAME).exists();
    let runs = absolute.parent().filter(|_| is_run).unwrap_or(&absolute);
    let folders = std::iter::once(folder.to_owned()).chain(entries(folder)?);
    for run in folders.filter(|run| run.join(Recorder::FILE_NAME).exists()) {
        match recorded(&run.join(Recorder::FILE_NAME), &policy) {
            Ok(played) => loaded.add(FoundEpisode::new(played, &run, runs)),
            Err(reason) => loaded.skipped.push(reason),
        }
    }
    Ok(())
}

fn recorded(path: &Path, folder_name: &str) -> Result<PlayedEpisode, String> {
    let recording = Recording::read(path).map_err(|error| error.to_string())?;
    let calls = recording.tool_calls().map_err(|error| error.to_string())?;
    let result = recording.result.clone().ok_or_else(|| format!("{} was interrupted", path.display()))?;
    let written = std::fs::metadata(path).and_then(|file| file.modified());
    Ok(PlayedEpisode {
        policy: path.parent().and_then(agent_file::card).unwrap_or_else(|| PolicyCard::from(folder_name)),
        spec: recording.spec.clone(),
        locomotion: recording.locomotion.clone(),
        build: recording.build.clone(),
        note: episode_note(&result, None),
        thought_s: calls.last().map_or(0.0, |call| call.thought.as_secs_f64()),
        keep_failed: false,
        attempts: Vec::new(),
        ended_at: written.ok().map(utc_text),
        result,
    })
}

/// Returns the entries of a folder, sorted by name.
fn entries(folder: &Path) -> Result<Vec<PathBuf>, LoadError> {
    let failed = |source| LoadError::Read { path: folder.into(), source };
    let entries = std::fs::read_dir(folder).map_err(failed)?;
    let mut paths: Vec<PathBuf> =
        entries.map(|entry| entry.map(|entry| entry.path())).collect::<Result<_, _>>().map_err(failed)?;
    paths.sort();
    Ok(paths)
}
