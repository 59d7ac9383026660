//! Folder of a run: its identity, and the processes that play in it at present.

use std::fmt;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::thread;
use std::time::Duration;

use tandem_episodes::{FileLock, LockKind, Locking, create_private_folder, write_whole};

use super::identity::RunIdentity;
use super::planned::is_planned_file;
use super::{EvaluationError, ExistingRun};
use crate::results::{EPISODES, PROCESSES_FILE, PlayedEpisode, STRESS};

/// The file with the run's identity.
const IDENTITY_FILE: &str = "run.json";

/// File on which every process holds a shared lock while it plays episodes of the run.
const PRESENCE_FILE: &str = "run.lock";

/// The file that is locked while the identity is read and written.
const IDENTITY_LOCK_FILE: &str = "run.json.lock";

/// Maximum number of attempts at a lock that other processes hold briefly.
const MAX_ATTEMPTS: u32 = 40;
const RETRY_INTERVAL: Duration = Duration::from_millis(50);

/// The folder of a run in which this process plays.
#[derive(Debug)]
pub struct EvaluationFolder {
    /// Builds whose results in the folder are reused.
    pub builds: Vec<String>,
    /// True if the file system has no locks, so that processes in the same folder do not detect each other.
    pub without_locks: bool,
    _presence: Option<FileLock>,
}

/// A different run in the folder, for an error that suggests ways to continue.
#[derive(Debug)]
pub struct OtherRun {
    pub folder: PathBuf,
    /// Differences between the runs, a line each.
    pub differences: Vec<String>,
    /// Number of episodes in the folder.
    pub kept: usize,
    /// True if only the build differs.
    pub only_build: bool,
    /// True if only tasks and seeds differ.
    pub only_episodes: bool,
}

impl fmt::Display for OtherRun {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let OtherRun { folder, differences, kept, only_build, only_episodes } = self;
        let folder = folder.display();
        write!(f, "{folder} holds another run with {kept} episodes, which are left as they are: ")?;
        write!(f, "{}; give --out (in Python `out`) for another folder", differences.join("; "))?;
        if *only_episodes {
            write!(
                f,
                ", or all its tasks and seeds and further ones, which are added to it (--shard I/N divides a run among processes)"
            )?;
        }
        if *only_build {
            write!(
                f,
                ", or --resume-with-new-build (`resume_with_new_build=True`), which keeps its episodes, says of which build \
                 they are, and plays the others"
            )?;
        }
        write!(f, ", or --overwrite (`overwrite=True`), which deletes it")
    }
}

impl EvaluationFolder {
    /// Creates the run `now` in the folder, or continues it. Fails if the folder contains a different run.
    pub fn open(
        folder: &Path,
        now: &RunIdentity,
        existing: ExistingRun,
    ) -> Result<EvaluationFolder, EvaluationError> {
        let failed = |source| EvaluationError::Io { path: folder.into(), source };
        let episodes = folder.join(EPISODES);
        create_private_folder(&episodes).map_err(failed)?;
        let _reading = FileLock::wait(&folder.join(IDENTITY_LOCK_FILE), || true).map_err(failed)?;
        let presence = folder.join(PRESENCE_FILE);
        let (alone, without_locks) = match take(&presence, LockKind::Exclusive).map_err(failed)? {
            Locking::Locked(_) => (true, false),
            Locking::Held => (false, false),
            Locking::Unsupported => (true, true),
        };
        if existing == ExistingRun::Overwrite {
            if !alone {
                return Err(EvaluationError::InUse { folder: folder.into() });
            }
            clear(folder).and_then(|()| create_private_folder(&episodes)).map_err(failed)?;
        }
        let builds = settle(folder, now, existing, alone)?;
        let presence = match take(&presence, LockKind::Shared).map_err(failed)? {
            Locking::Locked(lock) => Some(lock),
            Locking::Held => return Err(EvaluationError::InUse { folder: folder.into() }),
            Locking::Unsupported => None,
        };
        Ok(EvaluationFolder { builds, without_locks, _presence: presence })
    }
}

/// Returns `true` if a process plays in `folder`. Returns `None` if the file system has no locks, or the lock
/// file is missing.
pub fn is_being_played(folder: &Path) -> Option<bool> {
    let path = folder.join(PRESENCE_FILE);
    if !path.exists() {
        return None;
    }
    match FileLock::attempt(&path, LockKind::Exclusive) {
        Ok(Locking::Locked(_)) => Some(false),
        Ok(Locking::Held) => Some(true),
        Ok(Locking::Unsupported) | Err(_) => None,
    }
}

/// Attempts several times to take a lock that other processes hold only briefly.
fn take(path: &Path, kind: LockKind) -> io::Result<Locking> {
    let attempts = if kind == LockKind::Shared { MAX_ATTEMPTS } else { 2 };
    for _ in 1..attempts {
        match FileLock::attempt(path, kind)? {
            Locking::Held => thread::sleep(RETRY_INTERVAL),
            other => return Ok(other),
        }
    }
    FileLock::attempt(path, kind)
}

/// Compares the run `now` with the run in the folder, and writes the resulting identity. Returns the builds
/// whose results are reused.
fn settle(
    folder: &Path,
    now: &RunIdentity,
    existing: ExistingRun,
    alone: bool,
) -> Result<Vec<String>, EvaluationError> {
    let kept = episodes_in(folder);
    let known = match read(folder)? {
        Some(known) => vec![known],
        None => {
            kept.iter().filter_map(|path| read_episode(path)).map(|e| RunIdentity::of_episode(&e)).collect()
        }
    };
    let mut differences: Vec<String> = Vec::new();
    for difference in known.iter().flat_map(|known| known.differences(now)) {
        if !differences.contains(&difference) {
            differences.push(difference);
        }
    }
    let mut builds: Vec<String> = Vec::new();
    for build in known.iter().flat_map(|known| &known.builds) {
        if !builds.contains(build) {
            builds.push(build.clone());
        }
    }
    let last = known.last().map_or(now.build(), RunIdentity::build);
    let only_build = differences.is_empty();
    let is_of_episodes = |what: &String| what.starts_with("tasks are ") || what.starts_with("seeds are ");
    let only_episodes = !only_build && last == now.build() && differences.iter().all(is_of_episodes);
    if last != now.build() && !(only_build && existing == ExistingRun::ResumeWithNewBuild) {
        differences.push(format!("the build is {}, and was {last}", now.build()));
    }
    let is_replaced = !differences.is_empty();
    if is_replaced {
        // A folder without episodes can be reused for any run.
        if !kept.is_empty() || !alone {
            let kept = kept.len();
            let folder = folder.into();
            return Err(OtherRun { folder, differences, kept, only_build, only_episodes }.into());
        }
        builds.clear();
    }
    builds.retain(|build| build != now.build());
    builds.push(now.build().into());
    let path = folder.join(IDENTITY_FILE);
    let is_same = matches!(&known[..], [known] if known.builds == builds && !known.grows_to(now));
    if is_replaced || !is_same || !path.exists() {
        let text = serde_json::to_string_pretty(&RunIdentity { builds: builds.clone(), ..now.clone() })?;
        write_whole(&path, text.as_bytes())?;
    }
    Ok(builds)
}

/// Returns the identity of the run from `run.json`.
fn read(folder: &Path) -> Result<Option<RunIdentity>, EvaluationError> {
    let path = folder.join(IDENTITY_FILE);
    match fs::read(&path) {
        Ok(bytes) => serde_json::from_slice(&bytes)
            .map(Some)
            .map_err(|source| EvaluationError::UnreadableRun { path, reason: source.to_string() }),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(source) => Err(EvaluationError::Io { path, source }),
    }
}

/// Returns the files of single episodes.
fn episodes_in(folder: &Path) -> Vec<PathBuf> {
    let files = fs::read_dir(folder.join(EPISODES)).into_iter().flatten().flatten().map(|entry| entry.path());
    let mut files: Vec<PathBuf> =
        files.filter(|path| path.extension().is_some_and(|extension| extension == "json")).collect();
    files.sort();
    files
}

fn read_episode(path: &Path) -> Option<PlayedEpisode> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

/// Deletes the files of a run from its folder. A folder without a run remains unchanged.
fn clear(folder: &Path) -> io::Result<()> {
    if !folder.join(IDENTITY_FILE).exists()
        && !episodes_in(folder).iter().any(|path| read_episode(path).is_some())
    {
        return Ok(());
    }
    for entry in fs::read_dir(folder)? {
        let path = entry?.path();
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        match name.as_str() {
            EPISODES | STRESS => fs::remove_dir_all(&path)?,
            IDENTITY_FILE | PROCESSES_FILE => fs::remove_file(&path)?,
            name if name.ends_with(".json") && (name.starts_with("results") || is_planned_file(name)) => {
                fs::remove_file(&path)?;
            }
            _ => {}
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
